#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {
namespace {

/// Contact range under an unknown camera scale, mm.
constexpr double kMayTouch_mm = 1.15 * kTouch_mm;

bool acts_on_speed(const Block& block) {
  switch (block.target) {
    case Target::kGain:
    case Target::kGainLeft:
    case Target::kGainRight:
    case Target::kOffset:
    case Target::kAhead: return true;
    default: return false;
  }
}

}  // namespace

MotionModel Fitter::doubting(MotionModel model) const {
  model.touch_mm = std::max(model.touch_mm, kMayTouch_mm);
  model.contacts = true;
  model.doubts_rim = true;
  return model;
}

bool Fitter::holds_seem_elsewhere(const MotionModel& model) const {
  // Larger wheel and heading noise in contact indicates contacts. This compares it with the noise of free robots.
  MotionModel trial = doubting(model);
  const double with_noise = log_likelihood(trial);
  fit_noise(trial);
  std::size_t samples = 0;
  for (const TrackView& view : set_.views()) samples += view.track->held_out ? 0 : view.track->samples.size();
  constexpr double kSure = 30, kEach = 0.002;
  return log_likelihood(trial) > with_noise + kSure + kEach * static_cast<double>(samples);
}

void Fitter::straighten(MotionModel& model) const {
  const MotionModel before = model;
  model = doubting(model);
  model.room = {};
  constexpr int kPasses = 3;
  for (int pass = 0; pass < kPasses; ++pass) {
    fit_noise(model);
    step(model);
  }
  model.room = carried(before.room, before, model);
  settle_doubts(model);
}

void Fitter::settle_doubts(MotionModel& model) const {
  MotionModel trial = model;
  trial.doubts_rim = false;
  trial.touch_mm = touching_mm(trial.base, set_.set().has_headings);
  set_.find_centres(trial, threads_);
  trial.contacts = set_.meetings().share_within() < Meetings::kUnhindered;
  look_for_walls(trial);
  if (!set_.set().has_headings) find_walls(trial);
  fit_noise(trial);
  if (log_likelihood_of_all(trial) > log_likelihood_of_all(model)) model = trial;
}

bool Fitter::set_scale(MotionModel& model) const {
  constexpr double kNear = 0.15, kSame = 0.001;
  const std::vector<Pair> pairs = set_.pairs();
  const std::optional<TouchingApart> apart = touching_apart(pairs);
  hold_.reset();
  if (!apart || std::abs(apart->mm / kDiscs_mm - 1) > kNear) return false;
  const double factor = kDiscs_mm / apart->mm;
  if (!rescale(model, factor)) return false;
  std::vector<Pair> met;
  for (Pair pair : pairs)
    if (std::abs(pair.apart_mm - apart->mm) < 2) met.push_back(pair);
  hold_ = std::make_shared<const ScaleHold>(model, met, apart->sd_mm / kDiscs_mm);
  return std::abs(factor - 1) > kSame;
}

void Fitter::settle_scale(MotionModel& model) const {
  // Prior: the speeds and the wheel base of the ARGoS paper, independent normal. The exponent is quadratic in the
  // factor.
  const BaseParameters seed;
  // A speed effect leaves open at which covariate values the nominal speed holds: relative standard deviation.
  constexpr double kByEffects = 0.5;
  const bool nominal = std::none_of(model.terms.begin(), model.terms.end(), [](const Term& term) {
    return std::any_of(term.blocks.begin(), term.blocks.end(), acts_on_speed);
  });
  const auto speed_sd = [&](double sd, double value) { return nominal ? sd : std::hypot(sd, kByEffects * value); };
  double by_seed = 0, precision = 0;
  for (const auto& [value, expected, sd] :
       {std::array{model.base.straight_mm_s, seed.straight_mm_s,
                   speed_sd(prior_.straight_mm_s, seed.straight_mm_s)},
        std::array{model.base.turn_mm_s, seed.turn_mm_s, speed_sd(prior_.turn_mm_s, seed.turn_mm_s)},
        std::array{model.base.wheel_base_mm, seed.wheel_base_mm, prior_.wheel_base_mm}}) {
    by_seed += value * expected / (sd * sd);
    precision += value * value / (sd * sd);
  }
  if (by_seed <= 0) return;
  double log_factor = precision * std::log(by_seed / precision);
  if (hold_) {
    const double sure = 1 / (hold_->relative_sd() * hold_->relative_sd());
    log_factor += sure * std::log(hold_->factor(model));
    precision += sure;
  }
  rescale(model, std::exp(log_factor / precision));
}

}  // namespace kilotwin::identify

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {
namespace {

/// Contact range under an unknown camera scale, mm.
constexpr double kUncertainContact_mm = 1.15 * kContactRange_mm;

}  // namespace

void Fitter::set_uncertain_walls(MotionModel& model) {
  model.contact_range_mm = std::max(model.contact_range_mm, kUncertainContact_mm);
  model.contacts = true;
  model.walls_uncertain = true;
}

bool Fitter::contacts_contradict_geometry(const FitState& state) const {
  // Larger wheel and heading noise in contact indicates contacts. This compares it with the noise of free robots.
  FitState trial = state;
  set_uncertain_walls(trial.model);
  const double with_noise = log_likelihood(trial);
  fit_noise(trial);
  std::size_t samples = 0;
  for (const TrackView& view : state.tracks.views())
    samples += view.track->held_out ? 0 : view.track->samples.size();
  // Gain of the log likelihood from which on contacts contradict the geometry: nat, and nat per sample. Larger values
  // overlook distortions; smaller ones take other noise for contacts.
  constexpr double kSure = 30, kEach = 0.002;
  return log_likelihood(trial) > with_noise + kSure + kEach * static_cast<double>(samples);
}

void Fitter::fit_camera_distortion(FitState& state) const {
  MotionModel& model = state.model;
  const MotionModel before = model;
  set_uncertain_walls(model);
  model.walls = {};
  constexpr int kPasses = 3;  // passes without walls; fewer bring the walls back before the map has settled
  for (int pass = 0; pass < kPasses; ++pass) {
    fit_noise(state);
    step(state);
  }
  model.walls = carried(before.walls, before, model);
  resolve_walls(state);
}

void Fitter::resolve_walls(FitState& state) const {
  FitState trial = state;
  trial.model.walls_uncertain = false;
  trial.model.contact_range_mm = contact_range_of(trial.model.base, headings_);
  trial.tracks.find_centres(trial.model, threads_);
  trial.model.contacts = trial.tracks.encounters().overlap_density() < Encounters::kNoCollisions;
  update_walls(trial);
  if (!headings_) fit_walls(trial);
  fit_noise(trial);
  if (log_likelihood_of_all(trial) > log_likelihood_of_all(state)) state = std::move(trial);
}

bool Fitter::correct_camera_scale(FitState& state) {
  // Relative distance from the disc diameter beyond which the contact distance is no error of scale, and factor that counts
  // as no change. A larger first one accepts wrong distances; a smaller second one costs fits.
  constexpr double kNear = 0.15, kSame = 0.001;
  const std::vector<RobotPair> pairs = state.tracks.pairs();
  const std::optional<ContactDistance> apart = contact_distance(pairs);
  state.scale.reset();
  if (!apart || std::abs(apart->mm / kDiscDiameter_mm - 1) > kNear) return false;
  const double factor = kDiscDiameter_mm / apart->mm;
  if (!rescale(state.model, factor)) return false;
  std::vector<RobotPair> met;
  for (RobotPair pair : pairs)
    if (std::abs(pair.distance_mm - apart->mm) < 2) met.push_back(pair);
  state.scale = std::make_shared<const ScaleConstraint>(state.model, met, apart->sd_mm / kDiscDiameter_mm);
  return std::abs(factor - 1) > kSame;
}

void Fitter::choose_camera_scale(FitState& state) const {
  MotionModel& model = state.model;
  // Prior: the speeds and the wheel base of the ARGoS paper, independent normal. The exponent is quadratic in the
  // factor.
  const BaseParameters defaults;
  constexpr double kByEffects = 0.5;  // of a careless laboratory
  const BasePrior prior = prior_beside(model, kByEffects);
  double by_seed = 0, precision = 0;
  for (const auto& [value, expected, sd] :
       {std::array{model.base.straight_mm_s, defaults.straight_mm_s, prior.straight_mm_s},
        std::array{model.base.turn_mm_s, defaults.turn_mm_s, prior.turn_mm_s},
        std::array{model.base.wheel_base_mm, defaults.wheel_base_mm, prior.wheel_base_mm}}) {
    by_seed += value * expected / (sd * sd);
    precision += value * value / (sd * sd);
  }
  if (by_seed <= 0) return;
  double log_factor = precision * std::log(by_seed / precision);
  if (state.scale) {
    const double sure = 1 / (state.scale->relative_sd() * state.scale->relative_sd());
    log_factor += sure * std::log(state.scale->factor(model));
    precision += sure;
  }
  rescale(model, std::exp(log_factor / precision));
}

}  // namespace kilotwin::identify

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <utility>

#include "clients/identify/fit/fit.hpp"
#include "clients/identify/model/picture_scale.hpp"

namespace kilotwin::identify {
namespace {

/// The normal equations of a step: of the data, the base's prior and the terms'.
struct Equations {
  std::vector<Unit> units;
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  Eigen::VectorXd beforehand;  ///< precisions of the terms' coefficients
};

Equations equations_of(const Fitter& fitter, const MotionModel& model) {
  Equations e;
  e.units = linearise(model, fitter.set().units(), blocks_of(model), {100, fitter.threads()});
  const Eigen::Index n = e.units.front().information.rows();
  e.information = Eigen::MatrixXd::Zero(n, n);
  e.score = e.beforehand = Eigen::VectorXd::Zero(n);
  for (const Unit& unit : e.units) {
    e.information += unit.information;
    e.score += unit.score;
  }
  fitter.add_base_prior(model, e.information, e.score);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    const Eigen::Index count = term.coefficients.size();
    e.beforehand.segment(first, count) = term.precision;
    e.score.segment(first, count) -= term.precision.cwiseProduct(term.coefficients);
    first += count;
  }
  e.information.diagonal() += e.beforehand;
  // Along the common scale of a picture, speeds and wheel base nothing changes but how wide the noise is, which a step does not
  // see: it would go far for nothing.
  if (const Eigen::VectorXd by_scale = log_scale_by_coefficients(model); by_scale.size() > 0) {
    constexpr double kHeld = 1e-4;
    const Eigen::VectorXd row = by_scale / kHeld;
    e.information.bottomRightCorner(row.size(), row.size()).noalias() += row * row.transpose();
  }
  return e;
}

/// In a picture that shows all larger or smaller, robots that are so near may touch.
constexpr double kMayTouch_mm = 1.15 * kTouch_mm;

}  // namespace

void Fitter::look_for_walls(MotionModel& model) const {
  if (!set_.set().has_headings) return;
  const Room known = model.room;
  model.room = room_of(set_, model);
  for (double Room::*const side : {&Room::x_low_mm, &Room::x_high_mm, &Room::y_low_mm, &Room::y_high_mm})
    if (std::isinf(model.room.*side)) model.room.*side = known.*side;
}

double Fitter::worth(const MotionModel& model) const {
  double value = log_likelihood(model);
  for (const Term& term : model.terms) value -= 0.5 * term.precision.dot(term.coefficients.cwiseAbs2());
  return value;
}

void Fitter::step(MotionModel& model) const {
  const Equations e = equations_of(*this, model);
  // A step that makes things worse is held back first where the data say little, then everywhere.
  const MotionModel start = model;
  const bool pictured = start.measures() && start.room.any();
  const double before = worth(start);
  struct Trial {
    double firmness, length;
  };
  constexpr std::array<Trial, 6> kTrials = {{{0, 1}, {10, 1}, {100, 1}, {100, 0.4}, {100, 0.16}, {100, 0.06}}};
  bool better = false;
  for (const Trial& trial : kTrials) {
    Eigen::MatrixXd held = e.information;
    held.diagonal() += trial.firmness * e.beforehand;
    model = start;
    apply(model, e.units, trial.length * held.ldlt().solve(e.score));
    if (pictured) model.room = carried(start.room, start, model);
    better = worth(model) > before - 2;
    if (better) break;
  }
  if (!better) model = start;
  if (model.measures()) settle_scale(model);
}

MotionModel Fitter::doubting(MotionModel model) const {
  model.touch_mm = std::max(model.touch_mm, kMayTouch_mm);
  model.contacts = true;
  model.doubts_rim = true;
  return model;
}

bool Fitter::holds_seem_elsewhere(const MotionModel& model) const {
  // Noise that robots do not have unless they touch something, looked at where they do not.
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

}  // namespace kilotwin::identify

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {
namespace {

/// Largest speed of a wheel that the simulator takes, mm/s.
constexpr double kFastest_mm_s = 200;

/// The normal equations of a step: data, prior of the base parameters, prior of the terms.
struct Equations {
  std::vector<Unit> units;
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  Eigen::VectorXd prior_precision;  ///< prior precisions of the terms' coefficients
  double log_likelihood = 0;        ///< of the state, as Fitter::log_likelihood()
};

/// Sum over the tracks, in the order of Fitter::log_likelihood().
double sum_of(const PreparedSet& tracks, const std::vector<std::vector<const TrackView*>>& of_units,
              const std::vector<Unit>& units) {
  std::vector<double> sums(tracks.views().size());
  for (std::size_t u = 0; u < units.size(); ++u)
    for (std::size_t t = 0; t < of_units[u].size(); ++t)
      sums[static_cast<std::size_t>(of_units[u][t] - tracks.views().data())] = units[u].log_likelihood_of_track[t];
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// Log likelihood plus log prior of the coefficients.
double log_posterior(double log_likelihood, const MotionModel& model) {
  for (const Term& term : model.terms) log_likelihood -= 0.5 * term.precision.dot(term.coefficients.cwiseAbs2());
  return log_likelihood;
}

Equations equations_of(const Fitter& fitter, const FitState& state) {
  const MotionModel& model = state.model;
  Equations e;
  const std::vector<std::vector<const TrackView*>> tracks = state.tracks.units();
  e.units = linearise(model, tracks, blocks_of(model), {100, fitter.threads()});
  e.log_likelihood = sum_of(state.tracks, tracks, e.units);
  const Eigen::Index n = e.units.front().information.rows();
  e.information = Eigen::MatrixXd::Zero(n, n);
  e.score = e.prior_precision = Eigen::VectorXd::Zero(n);
  for (const Unit& unit : e.units) {
    e.information += unit.information;
    e.score += unit.score;
  }
  fitter.add_base_prior(model, e.information, e.score);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    const Eigen::Index count = term.coefficients.size();
    e.prior_precision.segment(first, count) = term.precision;
    e.score.segment(first, count) -= term.precision.cwiseProduct(term.coefficients);
    first += count;
  }
  e.information.diagonal() += e.prior_precision;
  // The likelihood is flat along the common scale of the camera map, the speeds and the wheel base. A step must
  // not move along it, so that direction is removed.
  if (const Eigen::VectorXd by_scale = log_scale_by_coefficients(model); by_scale.size() > 0) {
    // Standard deviation of the log scale, so small that steps keep it; a larger value lets them move along.
    constexpr double kHeld = 1e-4;
    const Eigen::VectorXd row = by_scale / kHeld;
    e.information.bottomRightCorner(row.size(), row.size()).noalias() += row * row.transpose();
  }
  return e;
}

bool acts_on_speed(const Block& block) {
  switch (block.target) {
    case Target::kGain:
    case Target::kGainLeft:
    case Target::kGainRight:
    case Target::kOffset:
    case Target::kOffsetLeft:
    case Target::kOffsetRight:
    case Target::kAhead: return true;
    default: return false;
  }
}

}  // namespace

Eigen::MatrixXd Fitter::information(const FitState& state) const { return equations_of(*this, state).information; }

BasePrior Fitter::prior_beside(const MotionModel& model, double by_effects) const {
  const bool nominal = std::none_of(model.terms.begin(), model.terms.end(), [](const Term& term) {
    return std::any_of(term.blocks.begin(), term.blocks.end(), acts_on_speed);
  });
  BasePrior prior = prior_;
  if (nominal) return prior;
  const BaseParameters defaults;
  prior.straight_mm_s = std::hypot(prior.straight_mm_s, by_effects * defaults.straight_mm_s);
  prior.turn_mm_s = std::hypot(prior.turn_mm_s, by_effects * defaults.turn_mm_s);
  return prior;
}

void Fitter::add_base_prior(const MotionModel& model, Eigen::MatrixXd& information, Eigen::VectorXd& score) const {
  const BaseParameters defaults;
  // With 0.2, speed, mean bias and a curve of gains may go apart until the speeds are twice the true ones (test:
  // Place.AStepInTrafficIsRecovered).
  constexpr double kByEffects = 0.1;
  const BasePrior prior = prior_beside(model, kByEffects);
  const auto add = [&](Eigen::Index i, double from, double sd) {
    information(i, i) += 1 / (sd * sd);
    score[i] += from / (sd * sd);
  };
  add(kStraightSpeed, defaults.straight_mm_s - model.base.straight_mm_s, prior.straight_mm_s);
  add(kTurnSpeed, defaults.turn_mm_s - model.base.turn_mm_s, prior.turn_mm_s);
  add(kWheelBase, defaults.wheel_base_mm - model.base.wheel_base_mm, prior.wheel_base_mm);
  add(kAheadPoint, defaults.ahead_mm - model.base.ahead_mm, prior.point_mm);
  add(kLeftPoint, defaults.left_mm - model.base.left_mm, prior.point_mm / 4);
}

void Fitter::apply(MotionModel& model, const std::vector<Unit>& units, const Eigen::VectorXd& step) {
  const auto limited = [](double value, double most) { return std::clamp(value, -most, most); };
  // Robots that seem to drive backwards, as under wrong headings, are no slower than robots at rest.
  const auto speed = [](double mm_s) { return std::clamp(mm_s, 0.0, kFastest_mm_s); };
  model.base.straight_mm_s = speed(model.base.straight_mm_s + limited(step[kStraightSpeed], 20));
  model.base.turn_mm_s = speed(model.base.turn_mm_s + limited(step[kTurnSpeed], 20));
  model.base.wheel_base_mm = std::clamp(model.base.wheel_base_mm + limited(step[kWheelBase], 3), 10.0, 60.0);
  model.base.ahead_mm += limited(step[kAheadPoint], 8);
  model.base.left_mm += limited(step[kLeftPoint], 8);
  Eigen::Index first = kBaseColumns;
  for (Term& term : model.terms) {
    term.coefficients += step.segment(first, term.coefficients.size());
    first += term.coefficients.size();
  }
  // A robot may have several units (tracks). Its bias is their precision-weighted mean.
  std::map<std::uint32_t, std::pair<Eigen::Matrix2d, Eigen::Vector2d>> sums;
  for (const Unit& unit : units) {
    const RobotBias was = model.bias_of(unit.robot);
    const Eigen::Vector2d bias = was.mean_mm_s + unit.bias_step - unit.bias_by_column * step;
    const Eigen::Matrix2d precision = unit.bias_covariance.inverse();
    auto [sum, made] = sums.try_emplace(unit.robot, Eigen::Matrix2d::Zero(), Eigen::Vector2d::Zero());
    sum->second.first += precision;
    sum->second.second += precision * bias;
  }
  double sum = 0, square = 0, count = 0;
  for (const auto& [robot, s] : sums) {
    RobotBias& bias = model.robots[robot];
    bias.covariance = s.first.inverse();
    bias.mean_mm_s = (bias.covariance * s.second).cwiseMax(-15).cwiseMin(15);
    sum += bias.mean_mm_s.sum();
    square += bias.mean_mm_s.squaredNorm() + bias.covariance.trace();
    count += 2;
  }
  // Population distribution of biases, with a prior at the ARGoS paper's values for few robots.
  const BaseParameters defaults;
  const double mean = sum / (count + kPriorBiases);
  const double variance = (square - 2 * mean * sum + count * mean * mean +
                           kPriorBiases * defaults.bias_sd_mm_s * defaults.bias_sd_mm_s) /
                          (count + kPriorBiases);
  model.base.bias_mean_mm_s = mean;
  model.base.bias_sd_mm_s = std::sqrt(std::max(variance, 0.01));
}

std::optional<double> Fitter::step(FitState& state) const {
  const Equations e = equations_of(*this, state);
  // Damps a step that lowers the posterior: first the directions with little information, then the whole step.
  MotionModel& model = state.model;
  const MotionModel start = model;
  const bool camera_fitted = start.measures() && start.walls.any();
  const double before = log_posterior(e.log_likelihood, model);
  struct Trial {
    double firmness, length;
  };
  // Weights of the prior beside the information, and shares of the step, in the order of trial. More trials cost a
  // likelihood each.
  constexpr std::array<Trial, 6> kTrials = {{{0, 1}, {10, 1}, {100, 1}, {100, 0.4}, {100, 0.16}, {100, 0.06}}};
  bool better = false;
  double likelihood = e.log_likelihood;
  for (const Trial& trial : kTrials) {
    Eigen::MatrixXd held = e.information;
    held.diagonal() += trial.firmness * e.prior_precision;
    model = start;
    apply(model, e.units, trial.length * held.ldlt().solve(e.score));
    if (camera_fitted) model.walls = carried(start.walls, start, model);
    const double found = log_likelihood(state);
    better = log_posterior(found, model) > before - 2;
    if (!better) continue;
    likelihood = found;
    break;
  }
  if (!better) model = start;
  if (!model.measures()) return likelihood;
  choose_camera_scale(state);
  return std::nullopt;
}

}  // namespace kilotwin::identify

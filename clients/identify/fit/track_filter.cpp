#include "clients/identify/fit/track_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

/// Squared Mahalanobis distance of an outlier: the 1 - 1e-5 quantile of chi squared with 2 and 3 degrees of
/// freedom.
constexpr double kGate2 = 23, kGate3 = 25.9;
/// Number of consecutive far outliers after which the track counts as lost.
constexpr int kLostAfter = 4;
constexpr double kFar = 60;
/// Time over which an unknown share in spells is taken as constant: about that between samples. Over a horizon, where a share may last
/// for longer, only rollouts give the distribution.
constexpr double kSpellKept_s = 0.5;

}  // namespace

StepJacobian step_jacobian(const StepRecord& record, double wheel_base_mm) {
  const Arc& arc = record.arc;
  const double h = record.h_s;
  const double world_x = record.rates.drift_x_mm_s * h, world_y = record.rates.drift_y_mm_s * h;
  const double forward = record.rates.forward_mm_s() * h;
  // A turn within the step also changes the direction of the rest of the step.
  const double bend_x = -arc.along_y * forward / 2, bend_y = arc.along_x * forward / 2;
  StepJacobian ways;
  ways.by_wheel << arc.along_x / 2 - bend_x / wheel_base_mm, arc.along_x / 2 + bend_x / wheel_base_mm,  //
      arc.along_y / 2 - bend_y / wheel_base_mm, arc.along_y / 2 + bend_y / wheel_base_mm,               //
      -1 / wheel_base_mm, 1 / wheel_base_mm;
  ways.by_heading << -(arc.dy_mm - world_y), arc.dx_mm - world_x;
  return ways;
}

double outlier_factor(double distance2, int size) {
  return std::max(1.0, distance2 / (size == 3 ? kGate3 : kGate2));
}

TrackFilter::TrackFilter(const MotionModel& model, const RobotBias& bias, std::uint32_t robot, std::uint32_t run)
    : model_(&model), sums_(model), measures_(model.measures()) {
  belief_.centre_mm = model.base.centre_mm;
  belief_.mean.tail<2>() = bias.mean_mm_s;
  belief_.covariance.bottomRightCorner<2, 2>() = bias.covariance;
  place_.robot = robot;
  place_.run = run;
  if (!model.stalls) return;
  spell_share_ = random_share_ = model.stalls->share();
  spell_variance_s_ = random_variance_s_ = model.stalls->variance_s(kSpellKept_s);
}

void TrackFilter::begin_forecast() {
  if (!forecasting_) in_spell(random_share_, random_variance_s_, false);
  forecasting_ = true;
}

/// A spell changes the speeds of the wheels by the motors, in proportion.
void TrackFilter::apply_spells(StepRecord& record) const {
  Rates& rates = record.rates;
  const double by = model_->stalls->gain - 1, change = by * spell_share_;
  const Eigen::Vector2d driven = rates.driven_mm_s();
  rates.left_mm_s += change * driven[0];
  rates.right_mm_s += change * driven[1];
  rates.left_gain *= 1 + change;
  rates.right_gain *= 1 + change;
  record.spell_noise = by * std::sqrt(spell_variance_s_) * driven;
  record.spell_unsure = spell_unsure_;
}

void TrackFilter::start(const Sample& sample, const Situation&, double heading_rad, double heading_sd_rad) {
  const BaseParameters& base = model_->base;
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  const double variance = heading_sd_rad * heading_sd_rad;
  // The tracked point is at the measurement. The reference point follows from the heading.
  Eigen::Vector3d by_heading(base.ahead_mm * s + base.left_mm * c, -base.ahead_mm * c + base.left_mm * s, 1);
  belief_.mean.head<3>() << sample.x_mm - base.ahead_mm * c + base.left_mm * s,
      sample.y_mm - base.ahead_mm * s - base.left_mm * c, heading_rad;
  belief_.covariance.topRows<3>().setZero();
  belief_.covariance.leftCols<3>().setZero();
  belief_.covariance.topLeftCorner<3, 3>() = variance * by_heading * by_heading.transpose();
  belief_.covariance(0, 0) += model_->noise.position_mm2;
  belief_.covariance(1, 1) += model_->noise.position_mm2;
  if (measures_) {
    // Removes the measurement effects by fixed-point iteration.
    const Situation at = situation(sample.time_s, CommandState{}, {});
    // Iterations; a stronger distortion needs more, and each costs an evaluation of the map.
    constexpr int kPasses = 6;
    for (int pass = 0; pass < kPasses; ++pass) {
      const Eigen::Vector3d seen = model_->measured(belief_.mean[0], belief_.mean[1], belief_.mean[2], at);
      if (has_heading(sample)) belief_.mean[2] += wrapped_angle(sample.heading_rad - seen[2]);
      belief_.mean[0] += sample.x_mm - seen[0];
      belief_.mean[1] += sample.y_mm - seen[1];
    }
  }
  outliers_ = 0;
}

Situation TrackFilter::situation(double time_s, const CommandState& commands, const NeighbourView& near) const {
  return situation(time_s, belief_.mean.head<3>(), commands, near);
}

Situation TrackFilter::situation(double time_s, const Eigen::Vector3d& pose, const CommandState& commands,
                                 const NeighbourView& near) const {
  Situation s = place_;
  s.time_s = time_s;
  s.heading_rad = pose[2];
  s.x_mm = pose[0] + belief_.centre_mm * std::cos(pose[2]);
  s.y_mm = pose[1] + belief_.centre_mm * std::sin(pose[2]);
  s.commands = commands;
  s.near = near;
  return s;
}

StepRecord TrackFilter::step(double time_s, double h_s, const CommandState& commands, const NeighbourView& near) {
  StepRecord record = step_freely(time_s, h_s, commands, near);
  touched_ = touched_ || record.at_robot;
  // The nearest centre is as unsure as the headings, by twice the offset from the tracked point.
  const double reach_mm = model_->contact_range_mm + 2 * std::abs(model_->base.centre_mm - model_->base.ahead_mm);
  beside_ = beside_ || (model_->contacts && near.nearest_mm < reach_mm);
  apply_walls();
  return record;
}

StepRecord TrackFilter::step_freely(double time_s, double h_s, const CommandState& commands,
                                    const NeighbourView& near) {
  StepRecord record;
  record.h_s = h_s;
  Eigen::Vector3d pose = belief_.mean.head<3>();
  if (!model_->terms.empty() && commands.driven()) {
    // Predicts half a step with the base model, for the covariates at the midpoint.
    Rates plain;
    const Eigen::Vector2d v = nominal_speeds(model_->base, commands.command) + belief_.mean.tail<2>();
    plain.left_mm_s = v[0];
    plain.right_mm_s = v[1];
    const Arc half = arc_of(plain, model_->base.wheel_base_mm, pose[2], h_s / 2);
    pose += Eigen::Vector3d(half.dx_mm, half.dy_mm, half.dheading_rad);
  }
  record.middle = situation(time_s + h_s / 2, pose, commands, near);
  record.middle.span_s = h_s;
  record.middle.commands.advance(h_s / 2);
  // Robots also push a robot at rest.
  record.at_robot = model_->contacts && near.nearest_mm < model_->contact_range_mm;
  record.at_wall = commands.driven() &&
                   (at_boundary_ || model_->walls.at_wall(record.middle.x_mm, record.middle.y_mm, kWallMargin_mm));
  record.rates = model_->rates(record.middle, belief_.mean.tail<2>(), sums_);
  if (model_->stalls && commands.driven()) apply_spells(record);
  record.arc = arc_of(record.rates, model_->base.wheel_base_mm, belief_.mean[2], h_s);
  propagate_covariance(record);
  belief_.mean[0] += record.arc.dx_mm;
  belief_.mean[1] += record.arc.dy_mm;
  belief_.mean[2] += record.arc.dheading_rad;
  return record;
}

void TrackFilter::apply_walls() {
  const Walls& walls = model_->walls;
  const double ahead = model_->base.centre_mm;
  // Early exit: few robots are near a wall.
  const StateCovariance& p = belief_.covariance;
  constexpr double kNear = 6;  // standard deviations
  const double reach = kNear * (std::sqrt(p(0, 0) + p(1, 1)) + std::abs(ahead) * std::sqrt(p(2, 2)));
  if (!walls.at_wall(belief_.mean[0], belief_.mean[1], reach + std::abs(ahead))) return;
  const Eigen::Vector2d by_heading(-ahead * std::sin(belief_.mean[2]), ahead * std::cos(belief_.mean[2]));
  const Eigen::Vector2d centre(belief_.mean[0] + by_heading[1], belief_.mean[1] - by_heading[0]);
  if (!walls.at_wall(centre[0], centre[1], reach)) return;
  apply_wall(0, walls.x_high_mm, 1);
  apply_wall(0, walls.x_low_mm, -1);
  apply_wall(1, walls.y_high_mm, 1);
  apply_wall(1, walls.y_low_mm, -1);
}

/// Censoring: X ~ N becomes min(X, wall). Its first two moments are closed forms. Its covariance with any jointly
/// normal variable is that of X times P(X < wall) (Stein's lemma).
void TrackFilter::apply_wall(Eigen::Index axis, double wall_mm, double outwards) {
  if (std::isinf(wall_mm)) return;
  const double c = std::cos(belief_.mean[2]), s = std::sin(belief_.mean[2]);
  const double by_heading = axis == 0 ? -model_->base.centre_mm * s : model_->base.centre_mm * c;
  StateCovariance& p = belief_.covariance;
  const double beyond = outwards * (belief_.mean[axis] + model_->base.centre_mm * (axis == 0 ? c : s) - wall_mm);
  const double variance = p(axis, axis) + 2 * by_heading * p(axis, 2) + by_heading * by_heading * p(2, 2);
  const double sd = std::sqrt(std::max(variance, 1e-6));
  constexpr double kNever = 4;  // standard deviations
  if (beyond < -kNever * sd) return;
  const double inside = stats::normal_cdf(-beyond / sd), density = stats::normal_pdf(beyond / sd);
  const double mean = beyond * inside - sd * density;
  const double square = (beyond * beyond + sd * sd) * inside - beyond * sd * density;
  const State with_all = p.col(axis) + by_heading * p.col(2);
  State own = inside * with_all - by_heading * p.col(2);
  own[axis] = std::max(0.0, square - mean * mean) - 2 * by_heading * inside * with_all[2] +
              by_heading * by_heading * p(2, 2);
  p.col(axis) = own;
  p.row(axis) = own.transpose();
  belief_.mean[axis] += outwards * (mean - beyond);
}

/// Covariance prediction: P = F P F' + Q.
void TrackFilter::propagate_covariance(const StepRecord& record) {
  const double h = record.h_s;
  const auto [by_heading, by_wheel] = step_jacobian(record, model_->base.wheel_base_mm);
  StateCovariance& p = belief_.covariance;
  const Noise& noise = model_->noise;
  Eigen::Vector3d own = Eigen::Vector3d::Constant(noise.drift_mm2_s * h);
  own[2] = kLeastTurn_rad2_s * h;
  Eigen::Matrix<double, 3, 2> by_bias = Eigen::Matrix<double, 3, 2>::Zero();
  if (record.middle.commands.driven()) {
    by_bias.col(0) = h * record.rates.left_gain * by_wheel.col(0);
    by_bias.col(1) = h * record.rates.right_gain * by_wheel.col(1);
    own[2] += noise.heading_rad2_s * h;
  }
  // F differs from the identity only in these columns: rows first, then columns. Known biases have zeros in P.
  const bool biased = p(3, 3) > 0 || p(4, 4) > 0;
  p.row(0) += by_heading[0] * p.row(2);
  p.row(1) += by_heading[1] * p.row(2);
  if (biased) p.topRows<3>() += by_bias * p.bottomRows<2>();
  p.col(0) += by_heading[0] * p.col(2);
  p.col(1) += by_heading[1] * p.col(2);
  if (biased) p.leftCols<3>() += p.rightCols<2>() * by_bias.transpose();
  if (record.middle.commands.driven()) {
    const Eigen::Vector2d wheels =
        h * (noise.factor_s * record.rates.driven_mm_s().cwiseAbs2().array() + noise.wheel_mm2_s);
    p.topLeftCorner<3, 3>() += by_wheel * wheels.asDiagonal() * by_wheel.transpose();
    if (model_->stalls) {
      const Eigen::Vector3d lost = by_wheel * record.spell_noise;
      p.topLeftCorner<3, 3>() += h * lost * lost.transpose();
    }
  }
  if (!forecasting_) {
    if (record.at_wall) own += h * Eigen::Vector3d(noise.wall_mm2_s, noise.wall_mm2_s, noise.wall_rad2_s);
    if (record.at_robot) own += h * Eigen::Vector3d(noise.contact_mm2_s, noise.contact_mm2_s, noise.contact_rad2_s);
  }
  p.diagonal().head<3>() += own;
}

void TrackFilter::step_mean(double time_s, double h_s, const CommandState& commands, const NeighbourView& near) {
  const State before = belief_.mean;
  const StateCovariance p = belief_.covariance;
  begin_forecast();
  const StepRecord record = step_freely(time_s, h_s, commands, near);
  // For a normal heading of variance P, E[cos] = cos exp(-P / 2). The covariance of speed and heading shifts the
  // mean.
  const double forward = record.rates.forward_mm_s();
  const double shrink = std::exp(-p(2, 2) / 2);
  const double together = (record.rates.left_gain * p(2, 3) + record.rates.right_gain * p(2, 4)) / 2;
  const double cx = record.arc.along_x * shrink, cy = record.arc.along_y * shrink;
  const Rates& r = record.rates;
  belief_.mean[0] = before[0] + h_s * (forward * cx - together * cy - r.sideways_mm_s * cy + r.drift_x_mm_s);
  belief_.mean[1] = before[1] + h_s * (forward * cy + together * cx + r.sideways_mm_s * cx + r.drift_y_mm_s);
  apply_walls();
}

Eigen::Matrix3d TrackFilter::jacobian(const Situation& at) const {
  Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
  const State& m = belief_.mean;
  if (!measures_) {
    const BaseParameters& base = model_->base;
    const double c = std::cos(m[2]), s = std::sin(m[2]);
    h(0, 2) = -base.ahead_mm * s - base.left_mm * c;
    h(1, 2) = base.ahead_mm * c - base.left_mm * s;
    return h;
  }
  // One-sided differences: measurement effects are nearly linear over these steps.
  const Eigen::Vector3d here = model_->measured(m[0], m[1], m[2], at);
  const double steps[] = {0.1, 0.1, 1e-4};
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    d[i] = steps[i];
    h.col(i) = (model_->measured(m[0] + d[0], m[1] + d[1], m[2] + d[2], at) - here) / steps[i];
  }
  return h;
}

Eigen::Vector3d TrackFilter::expected(double time_s, const CommandState& commands) const {
  return model_->measured(belief_.mean[0], belief_.mean[1], belief_.mean[2], situation(time_s, commands, {}));
}

double TrackFilter::predicted_variance_mm2(double time_s, const CommandState& commands) const {
  const Eigen::Matrix3d h = jacobian(situation(time_s, commands, {}));
  const Eigen::Matrix3d s = h * belief_.covariance.topLeftCorner<3, 3>() * h.transpose();
  return s(0, 0) + s(1, 1);
}

void TrackFilter::keep_within_walls(Eigen::Vector3d& difference) const {
  const Walls& walls = model_->walls;
  const double beyond_mm = 2 + 3 * std::sqrt(model_->noise.position_mm2);
  const auto keep = [&](Eigen::Index axis, double centre_mm, double low_mm, double high_mm) {
    const double at_mm = centre_mm + difference[axis];
    if (at_mm > high_mm + beyond_mm) difference[axis] = high_mm - centre_mm;
    if (at_mm < low_mm - beyond_mm) difference[axis] = low_mm - centre_mm;
  };
  keep(0, belief_.centre_x_mm(), walls.x_low_mm, walls.x_high_mm);
  keep(1, belief_.centre_y_mm(), walls.y_low_mm, walls.y_high_mm);
}

void TrackFilter::displace(Innovation& out, Eigen::Matrix3d s) {
  outliers_ = 0;
  StateCovariance& p = belief_.covariance;
  // Beyond its expectation, the number of dimensions, the push is as large as it looks.
  if (out.distance2 > out.size) {
    const double way_mm2 = out.difference.head<2>().squaredNorm() / 2;
    p(0, 0) += way_mm2;
    p(1, 1) += way_mm2;
    s.topLeftCorner<2, 2>() +=
        way_mm2 * out.jacobian.topLeftCorner<2, 2>() * out.jacobian.topLeftCorner<2, 2>().transpose();
  }
  const Eigen::Matrix<double, 5, 3> ph = p.leftCols<3>() * out.jacobian.transpose();
  out.covariance = s;
  out.gain = ph * s.inverse();
  out.gain.bottomRows<3>().setZero();
  belief_.mean += out.gain * out.difference;
  const StateCovariance known = out.gain * ph.transpose();
  p += out.gain * (s * out.gain.transpose()) - known - known.transpose();
  p = (0.5 * (p + p.transpose())).eval();
}

Innovation TrackFilter::update(const Sample& sample, const CommandState& commands) {
  Innovation out;
  out.size = has_heading(sample) ? 3 : 2;
  out.pose = belief_.mean.head<3>();
  const Situation at = situation(sample.time_s, commands, {});
  const Eigen::Vector3d seen = model_->measured(belief_.mean[0], belief_.mean[1], belief_.mean[2], at);
  out.jacobian = jacobian(at);
  out.difference << sample.x_mm - seen[0], sample.y_mm - seen[1],
      out.size == 3 ? wrapped_angle(sample.heading_rad - seen[2]) : 0.0;
  if (within_walls_ && measures_) keep_within_walls(out.difference);
  if (out.size == 2) out.jacobian.row(2).setZero();
  const Noise& noise = model_->noise;
  const Eigen::Matrix<double, 5, 3> ph = belief_.covariance.leftCols<3>() * out.jacobian.transpose();
  Eigen::Matrix3d s = out.jacobian * ph.topRows<3>();
  s(0, 0) += noise.position_mm2;
  s(1, 1) += noise.position_mm2;
  s(2, 2) = out.size == 3 ? s(2, 2) + noise.heading_rad2 : 1;
  Eigen::Matrix3d inverse = s.inverse();
  out.distance2 = out.difference.dot(inverse * out.difference);
  const bool touched = std::exchange(touched_, false), beside = std::exchange(beside_, false);
  const double factor = outlier_factor(out.distance2, out.size);
  // In contact a position says nothing of the heading. An outlier that need not be a push counts against its hypothesis.
  const bool displaces = contacts_displace_ && out.size == 2;
  if (!(displaces && touched))
    out.log_likelihood = -0.5 * (std::log(s.determinant()) + out.size * std::log(factor) + out.distance2 / factor);
  if (displaces && (touched || (beside && factor > 1))) {
    displace(out, s);
    return out;
  }
  if (factor > 1) {
    out.weight = 1 / factor;
    outliers_ = out.distance2 > kFar ? outliers_ + 1 : 0;
  } else {
    outliers_ = 0;
  }
  if (outliers_ >= kLostAfter) {
    // Restart at the measured position. The heading is measured, or gets a larger variance.
    out.lost = true;
    // Bounds of the heading's standard deviation after a restart: the track was lost, so that it is unsure; 1.8 is that of
    // any heading. A smaller upper bound would trust a wrong heading.
    constexpr double kLeast_rad = 0.4, kMost_rad = 1.8;
    const double known = std::clamp(3 * std::sqrt(belief_.covariance(2, 2)), kLeast_rad, kMost_rad);
    start(sample, at, out.size == 3 ? sample.heading_rad : belief_.mean[2],
          out.size == 3 ? std::sqrt(noise.heading_rad2) : known);
    return out;
  }
  s *= factor;
  inverse /= factor;
  out.covariance = s;
  out.gain = ph * inverse;
  belief_.mean += out.gain * out.difference;
  belief_.covariance -= out.gain * (s * out.gain.transpose());
  belief_.covariance = (0.5 * (belief_.covariance + belief_.covariance.transpose())).eval();
  return out;
}

}  // namespace kilotwin::identify

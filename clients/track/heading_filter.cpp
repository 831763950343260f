#include "clients/track/heading_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// The disc's centre ahead of the middle of the rear legs: docs/explanation/motion.md, axle_offset_mm.
constexpr double kAhead_mm = 9.2;

/// The state with which a mode begins. Speeds: docs/explanation/motion.md; the spread is that of uncalibrated robots.
struct Mode {
  double speed_mm_s, turn_rad_s, speed_sd, turn_sd;  ///< of held: velocity, and its standard deviations in mm/s
};
constexpr std::array<Mode, HeadingFilter::kModes> kModesOfMotion{{
    {0, 0, 0.05, 0.002},
    {10, 0, 2.5, 0.12},
    {10, 0.8, 2.5, 0.15},
    {10, -0.8, 2.5, 0.15},
    {0, 0, 6, 6},
    {0, 0, 0.05, 0.6},
}};
/// Rate at which a robot changes its mode, 1/s, and the share of these changes by which something begins to hold it. As many make
/// it turn in place where its heading is seen.
constexpr double kSwitching_1_s = 0.5, kHeldShare = 0.05;
/// The rate at which a robot that is held comes free, of kSwitching_1_s.
constexpr double kHeldLasts = 0.5;
/// So long after the start nothing holds the robot: a heading that is wrong at the start would never be corrected, because a robot
/// that is held may move in any direction.
constexpr double kKnownAfter_s = 5;
/// Densities of the noise of a robot that is held: heading rad^2/s, velocity (mm/s)^2/s. It may turn unseen.
constexpr double kHeldHeadingNoise = 0.05, kHeldVelocityNoise = 5;
/// Density of the noise of the turn rate of a robot that turns in place, (rad/s)^2/s.
constexpr double kTurnedNoise = 0.3;
/// More than twice what both motors could do.
constexpr double kMostTurn_rad_s = 4;
/// Densities of the noise while a mode lasts, per second: of the axle along its heading mm^2, heading rad^2, position otherwise mm^2,
/// speed (mm/s)^2, turn rate (rad/s)^2. The first two are those of wheels that let the heading wander by 1.4 degrees in a second.
constexpr double kAlongNoise = 0.1, kHeadingNoise = 6e-4, kOtherNoise = 0.01, kSpeedNoise = 0.3, kTurnNoise = 1e-3;
/// A robot that moved by this much moves: mm, and in standard deviations.
constexpr double kMoved_mm = 1.5, kMovedDeviations = 6;
/// While its heading is not known, the origin follows drift with this time constant, s.
constexpr double kForget_s = 3;
/// Weights do not fall below: a mode that was impossible may begin.
constexpr double kLeastWeight = 1e-4;

}  // namespace

void HeadingFilter::start(double time_s, double x_mm, double y_mm, double sd_mm, std::optional<double> bearing_rad,
                          double bearing_sd_rad) {
  if (!origin_) origin_ = {time_s, x_mm, y_mm};
  auto& [since_s, from_x, from_y] = *origin_;
  const double dx = x_mm - from_x, dy = y_mm - from_y, moved = std::hypot(dx, dy);
  const bool moves = moved > std::max(kMoved_mm, kMovedDeviations * sd_mm);
  if (!moves && !bearing_rad) {
    const double share = std::min(1.0, std::max(0.0, time_s - since_s) / kForget_s);
    origin_ = {time_s, from_x + share * dx, from_y + share * dy};
    return;
  }
  started_ = true;
  started_s_ = time_s_ = time_s;
  const double direction = std::atan2(dy, dx);
  for (std::size_t i = 0; i < kModes; ++i) {
    const Mode& mode = kModesOfMotion[i];
    const double offset = mode.speed_mm_s > 0 ? std::atan2(kAhead_mm * mode.turn_rad_s, mode.speed_mm_s) : 0;
    const double heading = bearing_rad ? *bearing_rad : wrapped(direction - offset);
    const double heading_sd = bearing_rad ? bearing_sd_rad : (i == 0 ? 0.7 : i >= kHeld ? 1.0 : 0.35);
    hypotheses_[i].state << x_mm, y_mm, heading, mode.speed_mm_s, mode.turn_rad_s;
    hypotheses_[i].covariance = Matrix::Zero();
    hypotheses_[i].covariance.diagonal() << sd_mm * sd_mm, sd_mm * sd_mm, heading_sd * heading_sd,
        mode.speed_sd * mode.speed_sd, mode.turn_sd * mode.turn_sd;
  }
  weights_ = moves ? std::array<double, kModes>{0.01, 0.53, 0.23, 0.23, 1e-4, 1e-4}
                   : std::array<double, kModes>{0.7, 0.1, 0.1, 0.1, 1e-4, 1e-4};
}

void HeadingFilter::mix(double dt_s, bool heading_is_seen) {
  const double leaves = 1 - std::exp(-kSwitching_1_s * dt_s);
  const double held = time_s_ - started_s_ < kKnownAfter_s ? kLeastWeight : kHeldShare;
  const double turned = heading_is_seen ? held : 0;
  const auto others = static_cast<double>(kModes - (heading_is_seen ? 1 : 2));  // that kHeld may change to
  const auto share_of = [=](std::size_t from, std::size_t to) {
    // Nobody sees any more how it turns.
    if (from == kTurned && !heading_is_seen) return to == kStop || to == kHeld ? 0.5 : 0.0;
    if (!heading_is_seen && to == kTurned) return 0.0;
    if (from >= kHeld) return from == to ? 1 - kHeldLasts * leaves : kHeldLasts * leaves / others;
    if (from == to) return 1 - leaves;
    if (to == kHeld) return held * leaves;
    return to == kTurned ? turned * leaves : (1 - held - turned) * leaves / (kModes - 3);
  };
  std::array<Hypothesis, kModes> mixed = hypotheses_;
  std::array<double, kModes> weights{};
  for (std::size_t to = 0; to < kModes; ++to) {
    const Mode& mode = kModesOfMotion[to];
    std::array<double, kModes> shares{};
    for (std::size_t from = 0; from < kModes; ++from) shares[from] = share_of(from, to) * weights_[from];
    for (const double share : shares) weights[to] += share;
    if (weights[to] == 0) continue;  // turned, where headings are not seen
    std::array<Hypothesis, kModes> entering = hypotheses_;
    for (std::size_t from = 0; from < kModes; ++from) {
      if (from == to) continue;
      // A mode begins with its own speeds.
      entering[from].state.tail<2>() << mode.speed_mm_s, mode.turn_rad_s;
      entering[from].covariance.rightCols<2>().setZero();
      entering[from].covariance.bottomRows<2>().setZero();
      entering[from].covariance(3, 3) = mode.speed_sd * mode.speed_sd;
      entering[from].covariance(4, 4) = mode.turn_sd * mode.turn_sd;
    }
    const Vector& reference = entering[to].state;
    Vector mean = Vector::Zero();
    std::array<Vector, kModes> off;
    for (std::size_t from = 0; from < kModes; ++from) {
      off[from] = entering[from].state - reference;
      off[from](2) = wrapped(off[from](2));
      mean += shares[from] / weights[to] * off[from];
    }
    mixed[to].state = reference + mean;
    mixed[to].state(2) = wrapped(mixed[to].state(2));
    mixed[to].covariance.setZero();
    for (std::size_t from = 0; from < kModes; ++from) {
      const Vector spread = off[from] - mean;
      mixed[to].covariance +=
          shares[from] / weights[to] * (entering[from].covariance + spread * spread.transpose());
    }
  }
  hypotheses_ = mixed;
  weights_ = weights;
}

void HeadingFilter::predict_held(Hypothesis& h, double dt_s) {
  h.state.head<2>() += dt_s * h.state.tail<2>();
  Matrix step = Matrix::Identity();
  step(0, 3) = step(1, 4) = dt_s;
  h.covariance = step * h.covariance * step.transpose();
  h.covariance(0, 0) += kAlongNoise * dt_s;
  h.covariance(1, 1) += kAlongNoise * dt_s;
  h.covariance(2, 2) += kHeldHeadingNoise * dt_s;
  h.covariance(3, 3) += kHeldVelocityNoise * dt_s;
  h.covariance(4, 4) += kHeldVelocityNoise * dt_s;
}

void HeadingFilter::predict_turned(Hypothesis& h, double dt_s) {
  h.state(2) = wrapped(h.state(2) + h.state(4) * dt_s);
  Matrix step = Matrix::Identity();
  step(2, 4) = dt_s;
  h.covariance = step * h.covariance * step.transpose();
  h.covariance(0, 0) += kOtherNoise * dt_s;
  h.covariance(1, 1) += kOtherNoise * dt_s;
  h.covariance(4, 4) += kTurnedNoise * dt_s;
}

void HeadingFilter::predict(double dt_s) {
  for (std::size_t i = 0; i < kModes; ++i) {
    Hypothesis& h = hypotheses_[i];
    if (i == kHeld) {
      predict_held(h, dt_s);
      continue;
    }
    if (i == kTurned) {
      predict_turned(h, dt_s);
      continue;
    }
    const double v = h.state(3), w = h.state(4);
    const double middle = h.state(2) + 0.5 * w * dt_s;
    const double c = std::cos(middle), s = std::sin(middle);
    const double vx = v * c - kAhead_mm * w * s, vy = v * s + kAhead_mm * w * c;
    h.state(0) += vx * dt_s;
    h.state(1) += vy * dt_s;
    h.state(2) = wrapped(h.state(2) + w * dt_s);
    Matrix jacobian = Matrix::Identity();
    jacobian(0, 2) = -vy * dt_s;
    jacobian(1, 2) = vx * dt_s;
    jacobian(0, 3) = c * dt_s;
    jacobian(1, 3) = s * dt_s;
    jacobian(0, 4) = (-kAhead_mm * s - 0.5 * dt_s * vy) * dt_s;
    jacobian(1, 4) = (kAhead_mm * c + 0.5 * dt_s * vx) * dt_s;
    jacobian(2, 4) = dt_s;
    h.covariance = jacobian * h.covariance * jacobian.transpose();
    const bool moves = i != kStop;
    h.covariance(0, 0) += kOtherNoise * dt_s;
    h.covariance(1, 1) += kOtherNoise * dt_s;
    if (moves) {
      // Wheels fluctuate: the axle moves on and turns, and never sideways. The centre of the disc is ahead of it.
      const Eigen::Vector2d along(c, s), ahead = kAhead_mm * Eigen::Vector2d(-s, c);
      h.covariance.topLeftCorner<2, 2>() +=
          dt_s * (kAlongNoise * along * along.transpose() + kHeadingNoise * ahead * ahead.transpose());
      h.covariance.block<2, 1>(0, 2) += dt_s * kHeadingNoise * ahead;
      h.covariance.block<1, 2>(2, 0) += dt_s * kHeadingNoise * ahead.transpose();
    }
    h.covariance(2, 2) += (moves ? kHeadingNoise : 1e-6) * dt_s;
    if (moves) {
      h.covariance(3, 3) += kSpeedNoise * dt_s;
      h.covariance(4, 4) += kTurnNoise * dt_s;
    }
  }
}

/// `turns`: the last component is a turn rate. Between two pictures a faster turn would look like a slower one, so that a rate once
/// wrong would grow without bound.
void HeadingFilter::correct(Hypothesis& h, const Vector& change, bool turns) {
  h.state += change;
  h.state(2) = wrapped(h.state(2));
  if (turns) h.state(4) = std::clamp(h.state(4), -kMostTurn_rad_s, kMostTurn_rad_s);
}

void HeadingFilter::measure(double x_mm, double y_mm, double sd_mm) {
  std::array<double, kModes> likelihoods{};
  for (std::size_t i = 0; i < kModes; ++i) {
    Hypothesis& h = hypotheses_[i];
    Eigen::Matrix2d total = h.covariance.topLeftCorner<2, 2>();
    total.diagonal().array() += sd_mm * sd_mm;
    const Eigen::Vector2d innovation(x_mm - h.state(0), y_mm - h.state(1));
    const Eigen::Matrix2d inverse = total.inverse();
    const Eigen::Matrix<double, 5, 2> gain = h.covariance.leftCols<2>() * inverse;
    correct(h, gain * innovation, i != kHeld);
    h.covariance -= gain * h.covariance.topRows<2>();
    h.covariance = 0.5 * (h.covariance + h.covariance.transpose()).eval();
    likelihoods[i] = -0.5 * innovation.dot(inverse * innovation) - 0.5 * std::log(total.determinant());
    // Robots do not drive backwards: a negative speed is the wrong heading.
    if (i != kStop && i < kHeld && h.state(3) < 0) likelihoods[i] -= 0.5 * h.state(3) * h.state(3);
  }
  weigh(likelihoods);
}

void HeadingFilter::measure_bearing(double bearing_rad, double sd_rad) {
  std::array<double, kModes> likelihoods{};
  for (std::size_t i = 0; i < kModes; ++i) {
    Hypothesis& h = hypotheses_[i];
    const double innovation = wrapped(bearing_rad - h.state(2));
    const double total = h.covariance(2, 2) + sd_rad * sd_rad;
    const Vector gain = h.covariance.col(2) / total;
    correct(h, gain * innovation, i != kHeld);
    const Matrix change = gain * h.covariance.row(2);
    h.covariance -= change;
    h.covariance = 0.5 * (h.covariance + h.covariance.transpose()).eval();
    likelihoods[i] = -0.5 * innovation * innovation / total - 0.5 * std::log(total);
  }
  weigh(likelihoods);
}

void HeadingFilter::weigh(const std::array<double, kModes>& log_likelihoods) {
  double most = -1e300, sum = 0;
  for (std::size_t i = 0; i < kModes; ++i) {
    if (weights_[i] > 0) most = std::max(most, log_likelihoods[i]);
  }
  for (std::size_t i = 0; i < kModes; ++i) {
    if (weights_[i] > 0) weights_[i] = std::max(kLeastWeight, weights_[i] * std::exp(log_likelihoods[i] - most));
    sum += weights_[i];
  }
  for (double& weight : weights_) weight /= sum;
}

void HeadingFilter::update(double time_s, double x_mm, double y_mm, double sd_mm, std::optional<double> bearing_rad,
                           double bearing_sd_rad) {
  if (!started_) {
    start(time_s, x_mm, y_mm, sd_mm, bearing_rad, bearing_sd_rad);
    return;
  }
  // Long gaps in steps: the path between is an arc.
  double left_s = time_s - time_s_;
  constexpr double kStep_s = 0.2;
  constexpr int kMostSteps = 50;
  for (int step = 0; left_s > 1e-9 && step < kMostSteps; ++step) {
    const double dt_s = step + 1 == kMostSteps ? left_s : std::min(kStep_s, left_s);
    mix(dt_s, bearing_rad.has_value());
    predict(dt_s);
    left_s -= dt_s;
  }
  time_s_ = std::max(time_s_, time_s);
  measure(x_mm, y_mm, sd_mm);
  if (bearing_rad) measure_bearing(*bearing_rad, bearing_sd_rad);
}

std::optional<Heading> HeadingFilter::heading() const {
  if (!started_) return std::nullopt;
  double c = 0, s = 0;
  for (std::size_t i = 0; i < kModes; ++i) {
    c += weights_[i] * std::cos(hypotheses_[i].state(2));
    s += weights_[i] * std::sin(hypotheses_[i].state(2));
  }
  const double mean = std::atan2(s, c);
  double variance = 0;
  for (std::size_t i = 0; i < kModes; ++i) {
    const double off = wrapped(hypotheses_[i].state(2) - mean);
    variance += weights_[i] * (hypotheses_[i].covariance(2, 2) + off * off);
  }
  return Heading{wrapped(mean), variance};
}

}  // namespace kilotwin::track

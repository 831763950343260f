#include "clients/monitor/robot_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"
#include "services/physics/drive.hpp"

namespace kilotwin::monitor {
namespace {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

constexpr double kLoose_mm2 = 1e4, kLoose_rad2 = 1;
/// Noise that a driven wheel has at least, mm^2/s.
constexpr double kLeastWheelNoise = 0.005;
/// Noise of a robot in contact: of its position, mm^2/s, and its heading, rad^2/s.
constexpr double kContact_mm2_s = 100, kContact_rad2_s = 0.5;

}  // namespace

RobotFilter::RobotFilter(Geometry geometry, BiasPrior prior) : geometry_(geometry), prior_(prior) {
  forget_biases();
}

void RobotFilter::forget_biases() {
  state_[3] = prior_.left_mm_s;
  state_[4] = prior_.right_mm_s;
  covariance_.rightCols<2>().setZero();
  covariance_.bottomRows<2>().setZero();
  covariance_(3, 3) = covariance_(4, 4) = prior_.sd_mm_s * prior_.sd_mm_s;
}

void RobotFilter::start(const MeasuredPose& at, double heading_rad, double heading_variance) {
  state_[0] = at.x_mm;
  state_[1] = at.y_mm;
  state_[2] = wrapped(heading_rad);
  covariance_.topRows<3>().setZero();
  covariance_.leftCols<3>().setZero();
  covariance_(0, 0) = at.xx;
  covariance_(0, 1) = covariance_(1, 0) = at.xy;
  covariance_(1, 1) = at.yy;
  covariance_(2, 2) = heading_variance;
  vx_mm_s_ = vy_mm_s_ = turn_rad_s_ = 0;
}

void RobotFilter::loosen() {
  covariance_.topRightCorner<3, 2>().setZero();
  covariance_.bottomLeftCorner<2, 3>().setZero();
  covariance_.topLeftCorner<3, 3>().setZero();
  covariance_(0, 0) = covariance_(1, 1) = kLoose_mm2;
  covariance_(2, 2) = kLoose_rad2;
}

Transition RobotFilter::predict(const WheelMotion& motion, double time_s, double jitter_s, bool touching) {
  Transition step;
  step.time_s = time_s;
  step.driven_s = motion.driven * time_s;
  step.left_mm = motion.left_mm_s(state_[3]) * time_s;
  step.right_mm = motion.right_mm_s(state_[4]) * time_s;
  step.left_per_bias_s = touching ? 0 : motion.gain_left * step.driven_s;
  step.right_per_bias_s = touching ? 0 : motion.gain_right * step.driven_s;
  const double run = (step.left_mm + step.right_mm) / 2;
  const double per_mm = 1 / geometry_.wheel_base_mm, turn = (step.right_mm - step.left_mm) * per_mm;
  const physics::Arc arc = physics::arc_of(run, turn, geometry_.axle_offset_mm);
  const double sideways = arc.sideways_mm + motion.sideways_mm_s * time_s;
  double s, c;
  kt_sincos(state_[2], &s, &c);
  step.x_heading = -(s * arc.forward_mm + c * sideways);
  step.y_heading = c * arc.forward_mm - s * sideways;
  // By the distance of a wheel: half the run, and a turn about the axle, to first order in the turn.
  const auto derivative = [&](double turn_per_mm) {
    const double forward = 0.5 - geometry_.axle_offset_mm * turn * turn_per_mm;
    const double across = 0.25 * turn + (0.5 * run + geometry_.axle_offset_mm) * turn_per_mm;
    return std::array{c * forward - s * across, s * forward + c * across, turn_per_mm};
  };
  step.per_left = derivative(-per_mm);
  step.per_right = derivative(per_mm);

  const double dx = -s * sideways + c * arc.forward_mm + motion.drift_x_mm_s * time_s;
  const double dy = c * sideways + s * arc.forward_mm + motion.drift_y_mm_s * time_s;
  state_[0] += dx;
  state_[1] += dy;
  state_[2] = wrapped(state_[2] + turn);
  vx_mm_s_ = dx / time_s;
  vy_mm_s_ = dy / time_s;
  turn_rad_s_ = turn / time_s;

  Covariance transition = Covariance::Identity();
  transition(0, 2) = step.x_heading;
  transition(1, 2) = step.y_heading;
  for (int i = 0; i < 3; ++i) {
    transition(i, 3) = step.per_left[static_cast<std::size_t>(i)] * step.left_per_bias_s;
    transition(i, 4) = step.per_right[static_cast<std::size_t>(i)] * step.right_per_bias_s;
  }
  covariance_ = (transition * covariance_ * transition.transpose()).eval();
  const Vector3 left(step.per_left[0], step.per_left[1], step.per_left[2]);
  const Vector3 right(step.per_right[0], step.per_right[1], step.per_right[2]);
  // Variances of the wheels' distances, mm^2. A driven wheel has some noise, whatever the model says.
  const auto wheel_noise = [&](double relative, double absolute, double distance_mm) {
    return std::max(relative * distance_mm * distance_mm / time_s + absolute * time_s,
                    kLeastWheelNoise * step.driven_s);
  };
  Matrix3 noise =
      left * left.transpose() * wheel_noise(motion.relative_noise_left, motion.noise_left, step.left_mm) +
      right * right.transpose() * wheel_noise(motion.relative_noise_right, motion.noise_right, step.right_mm);
  noise(0, 0) += motion.noise_position * time_s;
  noise(1, 1) += motion.noise_position * time_s;
  noise(2, 2) += motion.noise_turn * time_s;
  if (motion.change_left_mm_s != 0 || motion.change_right_mm_s != 0) {
    const Vector3 late = left * motion.change_left_mm_s + right * motion.change_right_mm_s;
    noise += late * late.transpose() * (jitter_s * jitter_s);
  }
  if (touching) {
    noise(0, 0) += kContact_mm2_s * time_s;
    noise(1, 1) += kContact_mm2_s * time_s;
    noise(2, 2) += kContact_rad2_s * time_s;
    covariance_.topRightCorner<3, 2>().setZero();
    covariance_.bottomLeftCorner<2, 3>().setZero();
  }
  covariance_.topLeftCorner<3, 3>() += noise;
  const double growth = touching ? 0 : prior_.growth_mm2_s3 * step.driven_s;
  covariance_(3, 3) += growth;
  covariance_(4, 4) += growth;
  return step;
}

Innovation RobotFilter::correct(const MeasuredPose& measured, double back_s) {
  Innovation innovation;
  const bool with_heading = measured.has_heading();
  innovation.dimensions = with_heading ? 3 : 2;
  Vector3 residual(measured.x_mm - (state_[0] - back_s * vx_mm_s_), measured.y_mm - (state_[1] - back_s * vy_mm_s_),
                   0);
  Matrix3 spread = covariance_.topLeftCorner<3, 3>();
  spread(0, 0) += measured.xx;
  spread(0, 1) += measured.xy;
  spread(1, 0) += measured.xy;
  spread(1, 1) += measured.yy;
  Eigen::Matrix<double, 5, 3> to_state = covariance_.leftCols<3>();
  if (with_heading) {
    residual[2] = wrapped(measured.heading_rad - (state_[2] - back_s * turn_rad_s_));
    spread(2, 2) += measured.heading_variance;
  } else {
    spread(0, 2) = spread(1, 2) = spread(2, 0) = spread(2, 1) = 0;
    spread(2, 2) = 1;
    to_state.col(2).setZero();
  }
  double s, c;
  kt_sincos(state_[2], &s, &c);
  Matrix3 to_body;
  to_body << c, s, 0, -s, c, 0, 0, 0, 1;
  const Matrix3 body = to_body * spread * to_body.transpose();
  const Eigen::LLT<Matrix3> factor(body);
  Matrix3 whitening = factor.matrixL().solve(to_body);
  if (!with_heading) whitening.row(2).setZero();
  Vector3 white = whitening * residual;
  const double distance = white.squaredNorm();
  double shrink = 1;
  if (distance > kGate) {
    innovation.is_outlier = true;
    shrink = kGate / distance;
    whitening *= __builtin_sqrt(shrink);
    white *= __builtin_sqrt(shrink);
  }
  const Eigen::Matrix<double, 5, 3> gain = to_state * spread.inverse() * shrink;
  state_ += gain * residual;
  state_[2] = wrapped(kt_fmod(state_[2], 2 * kPi));
  covariance_ -= (gain * to_state.transpose()).eval();
  covariance_ = ((covariance_ + covariance_.transpose()) / 2).eval();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    innovation.white[i] = white[row];
    for (std::size_t k = 0; k < 3; ++k) innovation.whitening[i][k] = whitening(row, static_cast<Eigen::Index>(k));
  }
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      innovation.gain[i][k] = gain(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  return innovation;
}

}  // namespace kilotwin::monitor

#include "clients/track/position_filter.hpp"

#include <Eigen/LU>

namespace kilotwin::track {
namespace {

constexpr double kSpeed_mm_s = 12;
/// Spectral density of the acceleration, mm^2/s^3: a robot that changes between rest and 10 mm/s about once a second.
constexpr double kAcceleration_mm2_s3 = 150;
/// A robot that is not seen may be anywhere it can drive to, but not faster than this.
constexpr double kMostVelocityVariance = 20.0 * 20.0;

Eigen::Matrix2d matrix(const Covariance& c) {
  Eigen::Matrix2d m;
  m << c.xx, c.xy, c.xy, c.yy;
  return m;
}

}  // namespace

PositionFilter::PositionFilter(double time_s, double x_mm, double y_mm, const Covariance& error_mm2)
    : time_s_(time_s), state_(x_mm, y_mm, 0, 0), p_(Eigen::Matrix4d::Zero()) {
  p_.topLeftCorner<2, 2>() = matrix(error_mm2);
  p_(2, 2) = p_(3, 3) = kSpeed_mm_s * kSpeed_mm_s;
}

void PositionFilter::predict(double time_s) {
  const double dt_s = time_s - time_s_;
  if (dt_s <= 0) return;
  time_s_ = time_s;
  state_.head<2>() += dt_s * state_.tail<2>();
  Eigen::Matrix4d step = Eigen::Matrix4d::Identity();
  step.topRightCorner<2, 2>() = dt_s * Eigen::Matrix2d::Identity();
  p_ = step * p_ * step.transpose();
  constexpr double q = kAcceleration_mm2_s3;
  for (const int axis : {0, 1}) {
    p_(axis, axis) += q * dt_s * dt_s * dt_s / 3;
    p_(axis, axis + 2) += q * dt_s * dt_s / 2;
    p_(axis + 2, axis) += q * dt_s * dt_s / 2;
    double& speed = p_(axis + 2, axis + 2);
    speed += q * dt_s;
    if (speed <= kMostVelocityVariance) continue;
    // Correlations are multiplied alike, so that the matrix stays a covariance.
    const double share = kMostVelocityVariance / speed;
    for (int other = 0; other < 4; ++other) {
      if (other == axis + 2) continue;
      p_(axis + 2, other) *= share;
      p_(other, axis + 2) *= share;
    }
    speed = kMostVelocityVariance;
  }
}

void PositionFilter::update(double x_mm, double y_mm, const Covariance& error_mm2) {
  const Eigen::Matrix2d inverse = (p_.topLeftCorner<2, 2>() + matrix(error_mm2)).inverse();
  const Eigen::Matrix<double, 4, 2> gain = p_.leftCols<2>() * inverse;
  state_ += gain * (Eigen::Vector2d(x_mm, y_mm) - state_.head<2>());
  p_ -= (gain * p_.topRows<2>()).eval();
  p_ = (0.5 * (p_ + p_.transpose())).eval();
}

double PositionFilter::distance2(double x_mm, double y_mm, const Covariance& error_mm2) const {
  const Eigen::Vector2d off(x_mm - state_(0), y_mm - state_(1));
  return off.dot((p_.topLeftCorner<2, 2>() + matrix(error_mm2)).inverse() * off);
}

}  // namespace kilotwin::track

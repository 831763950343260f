/// Kalman filter of one robot's position and velocity: nearly constant velocity, white acceleration noise.
#pragma once

#include <Eigen/Core>

#include "clients/track/covariance.hpp"

namespace kilotwin::track {

class PositionFilter {
 public:
  /// At rest as far as is known: the velocity's standard deviation is a Kilobot's speed.
  PositionFilter(double time_s, double x_mm, double y_mm, const Covariance& error_mm2);

  /// Goes on to `time_s`; earlier times change nothing.
  void predict(double time_s);
  /// A measured position with errors of that covariance, at the time of the last prediction.
  void update(double x_mm, double y_mm, const Covariance& error_mm2);

  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] double x_mm() const { return state_(0); }
  [[nodiscard]] double y_mm() const { return state_(1); }
  [[nodiscard]] double vx_mm_s() const { return state_(2); }
  [[nodiscard]] double vy_mm_s() const { return state_(3); }
  [[nodiscard]] Covariance covariance() const { return {p_(0, 0), p_(0, 1), p_(1, 1)}; }
  /// Squared Mahalanobis distance of a measurement from the prediction; two degrees of freedom.
  [[nodiscard]] double distance2(double x_mm, double y_mm, const Covariance& error_mm2) const;

 private:
  double time_s_;
  Eigen::Vector4d state_;  ///< x, y mm; velocity mm/s
  Eigen::Matrix4d p_;      ///< its covariance
};

}  // namespace kilotwin::track

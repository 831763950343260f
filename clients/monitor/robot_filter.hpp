/// The state of one robot under the current model: an extended Kalman filter over the pose of its disc and the biases of its
/// wheels. Every step also gives its linearisation, which carries the effect of a hypothesis into later innovations.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "clients/monitor/wheel_motion.hpp"
#include "core/trackers/measured_pose.hpp"

namespace kilotwin::monitor {

struct Geometry {
  double wheel_base_mm = 0, axle_offset_mm = 0;
};

/// Prior distribution of the biases.
struct BiasPrior {
  double left_mm_s = 0, right_mm_s = 0;  ///< means
  double sd_mm_s = 0;
  double growth_mm2_s3 = 0;  ///< growth of the variance per second of driving
};

/// Linearised motion over a step. The error of the state is (x mm, y mm, heading rad, left bias mm/s, right bias mm/s).
struct Transition {
  double x_heading = 0, y_heading = 0;  ///< derivatives by the heading at the start
  /// Derivatives of x, y, heading by the distance of a wheel, per mm.
  std::array<double, 3> per_left{}, per_right{};
  double left_per_bias_s = 0, right_per_bias_s = 0;  ///< derivatives of the distances by the biases
  double left_mm = 0, right_mm = 0;                  ///< distances of the wheels
  double driven_s = 0, time_s = 0;
};

/// A measurement as the filter took it.
struct Innovation {
  std::array<double, 3> white{};  ///< along, across, heading: independent and standard normal under the model
  std::size_t dimensions = 3;     ///< 2 without a heading
  std::array<std::array<double, 3>, 3> whitening{};  ///< white = whitening * (x, y, heading)
  std::array<std::array<double, 3>, 5> gain{};       ///< of the state by (x, y, heading)
  bool is_outlier = false;  ///< beyond the gate; the covariance was scaled so that it lies on it
};

class RobotFilter {
 public:
  using State = Eigen::Matrix<double, 5, 1>;
  using Covariance = Eigen::Matrix<double, 5, 5>;

  /// Squared Mahalanobis distance of the gate: three degrees of freedom exceed it with probability 1.5e-5.
  static constexpr double kGate = 25;

  RobotFilter(Geometry geometry, BiasPrior prior);

  /// Starts at a pose with a heading of the given variance, and biases as before.
  void start(const MeasuredPose& at, double heading_rad, double heading_variance);
  void forget_biases();
  /// The pose becomes unknown within some 100 mm and 1 rad; the biases stay.
  void loosen();

  /// `touching`: contacts disturb the robot, so the biases learn nothing.
  Transition predict(const WheelMotion& motion, double time_s, double jitter_s, bool touching);
  /// `back_s`: how much older than the state the measurement is, >= 0.
  Innovation correct(const MeasuredPose& measured, double back_s);

  [[nodiscard]] double x_mm() const { return state_[0]; }
  [[nodiscard]] double y_mm() const { return state_[1]; }
  [[nodiscard]] double heading_rad() const { return state_[2]; }
  [[nodiscard]] double bias_left_mm_s() const { return state_[3]; }
  [[nodiscard]] double bias_right_mm_s() const { return state_[4]; }
  [[nodiscard]] const Covariance& covariance() const { return covariance_; }
  [[nodiscard]] const BiasPrior& prior() const { return prior_; }

 private:
  Geometry geometry_;
  BiasPrior prior_;
  State state_ = State::Zero();
  Covariance covariance_ = Covariance::Zero();
  double vx_mm_s_ = 0, vy_mm_s_ = 0, turn_rad_s_ = 0;  ///< of the last step
};

}  // namespace kilotwin::monitor

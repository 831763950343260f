/// Where a robot is, by all that was measured of it so far: an extended Kalman filter over its pose and its two biases. The
/// tracker's noise and the motion's are apart; outliers count less; a robot that was carried away is found again.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

using State = Eigen::Matrix<double, 5, 1>;  ///< x, y of the drive's reference point, heading, bias left, bias right
using StateCovariance = Eigen::Matrix<double, 5, 5>;

struct Belief {
  State mean = State::Zero();
  StateCovariance covariance = StateCovariance::Zero();
  double centre_mm = kAxleOffset_mm;  ///< as in BaseParameters

  /// Of the disc's centre.
  [[nodiscard]] double centre_x_mm() const { return mean[0] + centre_mm * std::cos(mean[2]); }
  [[nodiscard]] double centre_y_mm() const { return mean[1] + centre_mm * std::sin(mean[2]); }
};

/// Sub-steps are no longer than this, s.
inline constexpr double kSubStep_s = 0.125;

/// One sub-step, linearised: how the pose at its end depends on things at its start.
struct StepRecord {
  Situation middle;  ///< where covariates were looked at
  Rates rates;
  Arc arc;
  double h_s = 0;
  bool at_wall = false, at_robot = false;  ///< which may have pushed it
  [[nodiscard]] bool touching() const { return at_wall || at_robot; }
};

/// How the pose at the end of a sub-step depends on the heading at its start, and on the wheels' ways within it.
struct StepWays {
  Eigen::Vector2d by_heading;  ///< x and y
  Eigen::Matrix<double, 3, 2> by_wheel;
};
[[nodiscard]] StepWays ways_of(const StepRecord&, double wheel_base_mm);

/// By how much the covariance of a measurement of so many numbers is widened where it is so far off, squared: 1, but for outliers.
[[nodiscard]] double outlier_factor(double distance2, int size);

/// A measurement taken in.
struct Innovation {
  int size = 0;  ///< 2 or 3: with the heading
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();  ///< of what is measured by the pose
  Eigen::Matrix<double, 5, 3> gain = Eigen::Matrix<double, 5, 3>::Zero();
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();  ///< as expected, before the measurement was taken in
  double distance2 = 0;                            ///< squared Mahalanobis distance
  double log_likelihood = 0;
  double weight = 1;  ///< below 1: an outlier
  bool lost = false;  ///< the filter had lost the robot and starts anew here
};

class TrackFilter {
 public:
  /// Of the heading, always: so that it is never known exactly.
  static constexpr double kLeastTurn_rad2_s = 1e-9;

  TrackFilter(const MotionModel& model, const RobotBias& bias, std::uint32_t robot, std::uint32_t run);

  /// At the first sample, with this heading; where one was measured there, what the tracker adds to it is taken off. `at` is not used.
  void start(const Sample&, const Situation& at, double heading_rad, double heading_sd_rad);
  [[nodiscard]] static bool has_heading(const Sample& sample) { return !std::isnan(sample.heading_rad); }

  /// A sub-step of `h_s` under one command, `commands` being the state at its start.
  StepRecord step(double time_s, double h_s, const CommandState& commands, const NeighbourView& near);
  /// The same with the mean as the mean of all headings that are possible, not the way of the mean heading: for predictions.
  void step_mean(double time_s, double h_s, const CommandState& commands, const NeighbourView& near);
  /// Nothing is measured any more, and what contacts will do is left to whoever knows all robots.
  void look_ahead() { looking_ahead_ = true; }
  /// In the steps from here on: the robot is at the rim of what robots reached.
  void at_rim(bool at_rim) { held_ = at_rim && model_->doubts_rim; }
  Innovation update(const Sample&, const CommandState& commands);

  [[nodiscard]] const Belief& belief() const { return belief_; }
  [[nodiscard]] Belief& belief() { return belief_; }
  /// What the tracker would see, and its covariance without the tracker's noise, mm^2.
  [[nodiscard]] Eigen::Vector3d expected(double time_s, const CommandState& commands) const;
  [[nodiscard]] double expected_spread_mm2(double time_s, const CommandState& commands) const;

 private:
  /// A sub-step as if there were no walls.
  StepRecord step_freely(double time_s, double h_s, const CommandState&, const NeighbourView&);
  /// Takes the disc's centre back behind walls that some of what is believed lies beyond.
  void hold_inside();
  void hold_behind(Eigen::Index axis, double wall_mm, double outwards);
  [[nodiscard]] Situation situation(double time_s, const CommandState&, const NeighbourView&) const;
  [[nodiscard]] Situation situation(double time_s, const Eigen::Vector3d& pose, const CommandState&,
                                    const NeighbourView&) const;
  [[nodiscard]] Eigen::Matrix3d jacobian(const Situation&) const;
  void spread(const StepRecord&);

  const MotionModel* model_;
  Belief belief_;
  Situation place_;   ///< robot and run
  int outliers_ = 0;  ///< in a row
  bool measures_;
  bool looking_ahead_ = false;
  bool held_ = false;
};

}  // namespace kilotwin::identify

/// Extended Kalman filter of one robot over its pose and its two biases (Sarkka, Bayesian Filtering and Smoothing,
/// 2013). Outliers get a larger measurement covariance. A lost track restarts at the measurement.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "clients/identify/model/block_sums.hpp"
#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

using State = Eigen::Matrix<double, 5, 1>;  ///< x, y of the reference point, heading, bias left, bias right
using StateCovariance = Eigen::Matrix<double, 5, 5>;

struct Belief {
  State mean = State::Zero();
  StateCovariance covariance = StateCovariance::Zero();
  double centre_mm = kAxleOffset_mm;  ///< as in BaseParameters

  /// Position of the disc centre, mm.
  [[nodiscard]] double centre_x_mm() const { return mean[0] + centre_mm * std::cos(mean[2]); }
  [[nodiscard]] double centre_y_mm() const { return mean[1] + centre_mm * std::sin(mean[2]); }
};

/// Longest sub-step, s.
inline constexpr double kSubStep_s = 0.125;

/// One sub-step with its linearisation.
struct StepRecord {
  Situation middle;  ///< covariates at the midpoint
  Rates rates;
  Arc arc;
  double h_s = 0;
  bool at_wall = false, at_robot = false;  ///< whether it may have been in contact
  bool spell_unsure = false;  ///< whether the share of a spell in it is uncertain (TrackFilter::in_spell)
  /// Standard deviation of the wheels' common motion by an unknown share in spells, mm/s^0.5.
  Eigen::Vector2d spell_noise = Eigen::Vector2d::Zero();
  /// Whether other causes than wheels may have acted.
  [[nodiscard]] bool in_contact() const { return at_wall || at_robot || spell_unsure; }
};

/// Jacobian of the pose at the end of a sub-step by the initial heading and by the paths of the wheels.
struct StepJacobian {
  Eigen::Vector2d by_heading;  ///< of x and y
  Eigen::Matrix<double, 3, 2> by_wheel;
};
[[nodiscard]] StepJacobian step_jacobian(const StepRecord&, double wheel_base_mm);

/// Factor of the innovation covariance for a squared Mahalanobis distance and 2 or 3 numbers. Above 1: an outlier.
[[nodiscard]] double outlier_factor(double distance2, int size);

/// One measurement update.
struct Innovation {
  int size = 0;  ///< 2, or 3 with the heading
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();  ///< of the measurement by the pose
  Eigen::Matrix<double, 5, 3> gain = Eigen::Matrix<double, 5, 3>::Zero();
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();  ///< predicted, before the update
  double distance2 = 0;                            ///< squared Mahalanobis distance
  double log_likelihood = 0;
  double weight = 1;  ///< below 1: an outlier
  bool lost = false;  ///< the track was lost and restarts here
};

class TrackFilter {
 public:
  /// Least process noise of the heading, so that its variance never vanishes.
  static constexpr double kLeastTurn_rad2_s = 1e-9;

  TrackFilter(const MotionModel& model, const RobotBias& bias, std::uint32_t robot, std::uint32_t run);

  /// Continues under another model of the same robot: what is believed of pose and biases stays.
  void take_model(const MotionModel& model) {
    model_ = &model;
    sums_ = BlockSums(model);
  }

  /// Initialises the filter at the first sample. Measurement effects are removed. `at` is not used.
  void start(const Sample&, const Situation& at, double heading_rad, double heading_sd_rad);
  [[nodiscard]] static bool has_heading(const Sample& sample) { return !std::isnan(sample.heading_rad); }

  /// Predicts a sub-step of `h_s` under one command. `commands`: the state at its start.
  StepRecord step(double time_s, double h_s, const CommandState& commands, const NeighbourView& near);
  /// The same, with the mean over the heading distribution in place of the path of the mean heading: for
  /// forecasts.
  void step_mean(double time_s, double h_s, const CommandState& commands, const NeighbourView& near);
  /// Starts a forecast: no further measurements, and no contact noise. The caller handles contacts.
  void begin_forecast();
  /// For the next steps: whether the robot is at the boundary of visited places.
  void at_boundary(bool at_boundary) { at_boundary_ = at_boundary && model_->walls_uncertain; }
  /// For the next steps: share of their time in a spell of MotionModel::stalls, with the variance of this share times the time over
  /// which it is constant, s. `unsure`: the motion gives no samples. Without a call, both numbers are those of a random instant.
  void in_spell(double share, double variance_s, bool unsure) {
    spell_share_ = share;
    spell_variance_s_ = variance_s;
    spell_unsure_ = unsure;
  }
  Innovation update(const Sample&, const CommandState& commands);
  /// From now on, a camera map that shows the disc centre clearly beyond a wall counts as wrong there: few data fix it along the walls,
  /// and robots that push against them are left out of its fit. Not for fits of walls, which such places contradict.
  void stay_within_walls() { within_walls_ = !model_->walls_uncertain; }

  /// For the next measurements without headings: whether positions in contact with another robot tell where the robot is, and not where
  /// it heads. Its motion there is the other's push. (Schmidt, 1966: an update that considers states without estimating them.)
  void contacts_displace(bool displace) { contacts_displace_ = displace; }

  [[nodiscard]] const Belief& belief() const { return belief_; }
  [[nodiscard]] Belief& belief() { return belief_; }
  /// The predicted measurement, and the trace of its position covariance without tracker noise, mm^2.
  [[nodiscard]] Eigen::Vector3d expected(double time_s, const CommandState& commands) const;
  [[nodiscard]] double predicted_variance_mm2(double time_s, const CommandState& commands) const;

 private:
  /// A sub-step without walls.
  StepRecord step_freely(double time_s, double h_s, const CommandState&, const NeighbourView&);
  /// Applies the walls to the distribution of the disc centre.
  void apply_walls();
  void apply_wall(Eigen::Index axis, double wall_mm, double outwards);
  [[nodiscard]] Situation situation(double time_s, const CommandState&, const NeighbourView&) const;
  [[nodiscard]] Situation situation(double time_s, const Eigen::Vector3d& pose, const CommandState&,
                                    const NeighbourView&) const;
  [[nodiscard]] Eigen::Matrix3d jacobian(const Situation&) const;
  void apply_spells(StepRecord&) const;
  void propagate_covariance(const StepRecord&);
  /// Takes the difference for a displacement by another robot: the heading stays as it is.
  void displace(Innovation&, Eigen::Matrix3d covariance);
  void keep_within_walls(Eigen::Vector3d& difference) const;

  const MotionModel* model_;
  BlockSums sums_;
  Belief belief_;
  Situation place_;   ///< robot and run
  int outliers_ = 0;  ///< in a row
  bool measures_;
  bool forecasting_ = false;
  bool at_boundary_ = false;
  bool within_walls_ = false;
  bool contacts_displace_ = false;
  bool touched_ = false, beside_ = false;  ///< since the last measurement: in contact with a robot, or perhaps so
  double spell_share_ = 0, spell_variance_s_ = 0;
  double random_share_ = 0, random_variance_s_ = 0;  ///< the same at a random instant
  bool spell_unsure_ = false;
};

}  // namespace kilotwin::identify

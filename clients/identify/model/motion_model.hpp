/// The motion model: differential drive with a bias per robot and wheel, process and measurement noise, and
/// effects. It equals the simulator's model (docs/explanation/motion.md), with effects as linear combinations of basis columns.
/// Lengths mm, times s, angles rad.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/identify/model/basis.hpp"
#include "clients/identify/model/contact_geometry.hpp"
#include "clients/identify/model/stalls.hpp"
#include "clients/identify/model/traffic_grid.hpp"
#include "core/effects/motion_change.hpp"

namespace kilotwin::identify {

/// Disc centre ahead of the drive's reference point (as in idl/model.proto), mm.
inline constexpr double kAxleOffset_mm = 9.2;

struct BaseParameters {
  double straight_mm_s = 10, turn_mm_s = 20, wheel_base_mm = 25;
  /// The tracked point in the body frame, from the reference point of the drive.
  double ahead_mm = kAxleOffset_mm, left_mm = 0;
  /// The disc centre, ahead of the reference point. Contacts and covariates refer to it.
  double centre_mm = kAxleOffset_mm;
  double bias_mean_mm_s = 0.015, bias_sd_mm_s = 1.86;
  /// Robots follow commands this much later than their stamps: a property of the clocks of the data. s
  double command_lag_s = 0;
};

/// Noise variances. Those "per second" grow with time.
struct Noise {
  double factor_s = 0.002;       ///< of a driven wheel's path, relative to its speed squared
  double wheel_mm2_s = 0.05;     ///< of a wheel's path, while driven
  double heading_rad2_s = 1e-5;  ///< of the heading, while driven
  double drift_mm2_s = 1e-3;     ///< of the position along each axis, always
  double position_mm2 = 1;       ///< of a measured position along each axis
  double heading_rad2 = 2.5e-3;  ///< of a measured heading
  /// Contact noise, added to the pose at walls and at other robots.
  double wall_mm2_s = 5, wall_rad2_s = 0.01, contact_mm2_s = 60, contact_rad2_s = 0.03;
};

/// Posterior of a robot's biases: left and right wheel.
struct RobotBias {
  Eigen::Vector2d mean_mm_s = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

enum class Target : std::uint8_t {
  kGain,  ///< relative, both wheels
  kGainLeft,
  kGainRight,
  kOffset,  ///< mm/s, both wheels
  kOffsetLeft,
  kOffsetRight,
  kTurn,      ///< rad/s
  kAhead,     ///< mm/s, along the heading
  kSideways,  ///< mm/s, to the left
  kWorldX,    ///< mm/s
  kWorldY,
  kMeasuredX,  ///< mm
  kMeasuredY,
  kMeasuredAhead,  ///< mm, along the heading
  kMeasuredLeft,
  kMeasuredScale,    ///< relative
  kMeasuredTurn,     ///< rad: rotation of the whole image about its origin, headings included
  kMeasuredHeading,  ///< rad
};
[[nodiscard]] constexpr bool is_gain(Target target) { return target <= Target::kGainRight; }
[[nodiscard]] constexpr bool is_measured(Target target) { return target >= Target::kMeasuredX; }

inline constexpr std::uint8_t kDriven = 0b1110, kAlways = 0b1111;  ///< bits 1 << Motion

/// Basis columns that act on one target.
struct Block {
  Target target;
  Basis basis;
  std::uint8_t during = kDriven;  ///< commands under which it acts, bits 1 << Motion
};

/// One effect: blocks with their coefficients.
struct Term {
  std::string name;
  std::vector<Block> blocks;
  Eigen::VectorXd coefficients;  ///< of all blocks, in order
  /// Prior precisions of the coefficients. The prior mean is 0.
  Eigen::VectorXd precision;
  /// A nonparametric term of several covariates: it keeps its bases, and is written as a table.
  bool general = false;
};

/// Whether the term is a map of camera distortion.
[[nodiscard]] bool is_camera_map(const Term&);

/// Limit of effects on a speed (core/effects/motion_change.hpp). Default of Motion.effects_limit_mm_s in idl/model.proto.
inline constexpr double kEffectsLimit_mm_s = 50;

/// Speeds of a robot at one instant: effects included, and what derivatives need of their parts.
struct Rates : DriveSpeeds {
  double left_base_mm_s = 0, right_base_mm_s = 0;  ///< v + b, without effects
  double left_gain = 1, right_gain = 1;
  double turn_effects_rad_s = 0;  ///< turn rate by effects that state one; independent of the wheel base

  /// Speed of the reference point along the heading.
  [[nodiscard]] double forward_mm_s() const { return (left_mm_s + right_mm_s) / 2; }
  /// Speeds of the wheels by the motors, with gains. Factor noise is relative to these.
  [[nodiscard]] Eigen::Vector2d driven_mm_s() const {
    return {left_base_mm_s * left_gain, right_base_mm_s * right_gain};
  }
};

class BlockSums;  // block_sums.hpp

struct MotionModel {
  BaseParameters base;
  Noise noise;
  Walls walls;
  bool contacts = true;  ///< whether robots collide with each other
  /// Log likelihood of the disc centre over that of its alternative; 0: the data do not tell them apart.
  double centre_evidence = 0;
  /// Whether walls may be anywhere along the boundary of visited places. `walls` is then not used for contacts.
  bool walls_uncertain = false;
  /// Robots with estimated centres this close may be in contact, mm.
  double contact_range_mm = kContactRange_mm;
  /// Traffic grids: driven time without and with decay, and trails of other robots.
  std::array<GridCells, kTrafficGrids> cells = {GridCells{20},
                                                {28},
                                                {39},
                                                {55},
                                                {78},
                                                {110},
                                                {30, 0, 0, 10},
                                                {50, 0, 0, 10},
                                                {30, 0, 0, 40},
                                                {50, 0, 0, 40},
                                                {30, 0, 0, 10, true},
                                                {50, 0, 0, 10, true}};
  std::vector<Term> terms;
  std::optional<Stalls> stalls;  ///< none: no spells
  std::map<std::uint32_t, RobotBias> robots;

  /// The robot's posterior, or the population distribution.
  [[nodiscard]] RobotBias bias_of(std::uint32_t robot) const;
  [[nodiscard]] Rates rates(const Situation&, const Eigen::Vector2d& bias_mm_s) const;
  /// The same in many situations. `sums`: of this model.
  [[nodiscard]] Rates rates(const Situation&, const Eigen::Vector2d& bias_mm_s, BlockSums& sums) const;
  [[nodiscard]] bool looks_at(const Axis&) const;
  [[nodiscard]] bool measures() const;  ///< whether any term is a measurement effect

  /// Measured x, y, heading of a robot with its reference point at x, y.
  [[nodiscard]] Eigen::Vector3d measured(double x_mm, double y_mm, double heading_rad, const Situation&) const;
  /// Pose of the reference point given a measurement. Without a measured heading, the heading is taken as 0.
  [[nodiscard]] Eigen::Vector3d pose_of(const Sample&, const Situation&) const;
};

/// Speeds of the left and the right wheel without bias, mm/s. Straight: both wheels. Turn: only the outer wheel.
/// Stop: none.
[[nodiscard]] Eigen::Vector2d nominal_speeds(const BaseParameters&, Motion);

/// Motion at constant rates for `h_s`: an exact arc.
struct Arc {
  double dx_mm, dy_mm, dheading_rad;
  double along_x, along_y;  ///< d(dx, dy)/d(forward speed) / h: mean direction, shortened by the arc
};
[[nodiscard]] Arc arc_of(const Rates&, double wheel_base_mm, double heading_rad, double h_s);

}  // namespace kilotwin::identify

/// The model that is fitted: differential drive with a bias per robot and wheel, noise, and effects. As the simulator runs it
/// (docs/explanation/motion.md), but for effects being sums over the columns of a basis. Lengths mm, times s, angles rad.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "clients/identify/model/basis.hpp"
#include "clients/identify/model/traffic_grid.hpp"
#include "clients/identify/model/contact_geometry.hpp"

namespace kilotwin::identify {

/// Of the disc's centre, ahead of the drive's reference point (as in idl/model.proto).
inline constexpr double kAxleOffset_mm = 9.2;

struct BaseParameters {
  double straight_mm_s = 10, turn_mm_s = 20, wheel_base_mm = 25;
  /// The tracked point in the body, from the reference point of the drive.
  double ahead_mm = kAxleOffset_mm, left_mm = 0;
  /// The disc's centre, ahead of that point: where robots touch, and where effects look.
  double centre_mm = kAxleOffset_mm;
  double bias_mean_mm_s = 0.015, bias_sd_mm_s = 1.86;
};

/// Variances; "per second" ones grow with time.
struct Noise {
  double factor_s = 0.002;       ///< of a driven wheel's way, relative to its speed squared, s
  double wheel_mm2_s = 0.05;     ///< of a wheel's way, while driven
  double heading_rad2_s = 1e-5;  ///< of the heading, while driven
  double drift_mm2_s = 1e-3;     ///< of the position along each axis, always
  double position_mm2 = 1;       ///< of a measured position along each axis
  double heading_rad2 = 2.5e-3;  ///< of a measured heading
  /// What touching adds to the motion: at walls, and at other robots.
  double wall_mm2_s = 5, wall_rad2_s = 0.01, contact_mm2_s = 60, contact_rad2_s = 0.03;
};

/// A robot's own: bias of the left and the right wheel.
struct RobotBias {
  Eigen::Vector2d mean_mm_s = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

enum class Target : std::uint8_t {
  kGain,  ///< relative, of both wheels
  kGainLeft,
  kGainRight,
  kOffset,    ///< mm/s, both wheels
  kTurn,      ///< rad/s
  kAhead,     ///< mm/s, in the body
  kSideways,  ///< mm/s, to the left
  kWorldX,    ///< mm/s
  kWorldY,
  kMeasuredX,  ///< mm
  kMeasuredY,
  kMeasuredAhead,  ///< mm, in the body
  kMeasuredLeft,
  kMeasuredScale,    ///< relative
  kMeasuredTurn,     ///< rad: of the whole picture about its origin, headings with it
  kMeasuredHeading,  ///< rad
};
[[nodiscard]] constexpr bool is_measured(Target target) { return target >= Target::kMeasuredX; }

inline constexpr std::uint8_t kDriven = 0b1110, kAlways = 0b1111;  ///< bits of Motion

/// Columns of a basis that act on one target.
struct Block {
  Target target;
  Basis basis;
  std::uint8_t during = kDriven;  ///< bits 1 << Motion
};

/// Blocks with coefficients: one cause.
struct Term {
  std::string name;
  std::vector<Block> blocks;
  Eigen::VectorXd coefficients;  ///< of all blocks, in order
  /// Precisions of the coefficients beforehand, about 0.
  Eigen::VectorXd precision;
};

/// The curve of its first block as one that is known, as the coefficients are now. `factor`: which of the block's it is; others, if
/// there are any, are known.
[[nodiscard]] Factor known_curve(const Term&, std::size_t factor);
/// Whether it bends what is seen from place to place.
[[nodiscard]] bool is_map_of_picture(const Term&);

/// Speeds of a robot at an instant.
struct Rates {
  double left_mm_s = 0, right_mm_s = 0;            ///< of the wheels, effects included
  double left_base_mm_s = 0, right_base_mm_s = 0;  ///< v + b, before effects
  double left_gain = 1, right_gain = 1;
  double turn_rad_s = 0;  ///< besides what the wheels make
  double ahead_mm_s = 0, sideways_mm_s = 0;
  double world_x_mm_s = 0, world_y_mm_s = 0;
};

struct MotionModel {
  BaseParameters base;
  Noise noise;
  Room room;
  bool contacts = true;  ///< robots push each other
  /// Walls may be anywhere along the rim of what robots reached, whatever `room` has.
  bool doubts_rim = false;
  /// Robots whose centres are this near, by what is known of where they are, may touch, mm.
  double touch_mm = kTouch_mm;
  /// Square cells in which the floor may remember.
  std::array<FloorCells, kFloorCells> cells = {FloorCells{20}, {28}, {39}, {55}, {78}, {110}};
  std::vector<Term> terms;
  std::map<std::uint32_t, RobotBias> robots;

  /// The robot's own, or the distribution of all.
  [[nodiscard]] RobotBias bias_of(std::uint32_t robot) const;
  [[nodiscard]] Rates rates(const Situation&, const Eigen::Vector2d& bias_mm_s) const;
  [[nodiscard]] bool looks_at(const Axis&) const;
  [[nodiscard]] bool measures() const;  ///< whether some term acts on what is measured

  /// What is measured of a robot whose reference point is at x, y: position and heading.
  [[nodiscard]] Eigen::Vector3d measured(double x_mm, double y_mm, double heading_rad, const Situation&) const;
  /// Where the reference point is and how it points, of what was measured; without a heading it is taken to point along x.
  [[nodiscard]] Eigen::Vector3d pose_of(const Sample&, const Situation&) const;
};

/// Speeds of the left and the right wheel with no bias, mm/s: both going straight, in a turn only the one on its outside, at rest
/// none.
[[nodiscard]] Eigen::Vector2d nominal_speeds(const BaseParameters&, Motion);

/// A way at constant rates for `h_s` from a heading: exact arcs.
struct Arc {
  double dx_mm, dy_mm, dheading_rad;
  double along_x, along_y;  ///< mean direction of the way, shortened by the arc: d(dx)/d(forward speed) / h
};
[[nodiscard]] Arc arc_of(const Rates&, double wheel_base_mm, double heading_rad, double h_s);

}  // namespace kilotwin::identify

/// Covariates of effects: values of one robot at one instant, named as in model files. Lengths mm, times s, angles
/// rad.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "clients/identify/data/command_clock.hpp"
#include "core/plan/effect_settings.hpp"

namespace kilotwin::identify {

/// Neighbourhood radii, mm, centre to centre: from contact to about the radio range.
inline constexpr std::array<double, 14> kNeighbourRadii_mm = {40,  50,  60,  70,  80,  90,  100,
                                                              110, 120, 130, 140, 150, 175, 200};

/// Number of traffic grids, each with its own cell size (MotionModel::cells).
inline constexpr std::size_t kTrafficGrids = 12;
/// The last ones hold trails of other robots; the others hold driven time.
inline constexpr std::size_t kFirstTrailGrid = 10;

/// One neighbour, relative to a robot.
struct OtherRobot {
  float distance_mm = 0;               ///< centre to centre
  float towards_x = 0, towards_y = 0;  ///< unit vector; 0 if both are at the same place
  std::uint32_t robot : 31 = 0;        ///< robot number
  std::uint32_t driven : 1 = 1;        ///< whether a motor is commanded to turn
};
static_assert(sizeof(OtherRobot) == 16);
/// Radius of the list of neighbours, mm.
inline constexpr double kListed_mm = 160;

/// The neighbours of one robot at one instant, and the traffic at its place.
struct NeighbourView {
  double nearest_mm = 1e9;                                  ///< centre to centre
  double direction_rad = 0;                                 ///< direction of the nearest, from the x axis
  std::array<float, kNeighbourRadii_mm.size()> count = {};  ///< number within each of kNeighbourRadii_mm
  /// sum of (1 - (distance / radius)^2)^2 for each of kNeighbourRadii_mm
  std::array<float, kNeighbourRadii_mm.size()> density = {};
  /// in its cell of each grid: driven time of all robots, itself included, s; or freshness of the trail of another one, 0..1
  std::array<float, kTrafficGrids> traffic = {};
  /// Neighbours within kListed_mm: `listed` entries of this list from `first_listed` on. Null: not listed.
  const std::vector<OtherRobot>* list = nullptr;
  std::uint32_t first_listed = 0, listed = 0;
};

struct Situation {
  double time_s = 0;
  double x_mm = 0, y_mm = 0;  ///< disc centre
  double heading_rad = 0;
  CommandState commands;
  NeighbourView near;
  std::uint32_t robot = 0;  ///< robot number
  std::uint32_t run = 0;    ///< index of the run
  double span_s = 0;        ///< length of the sub-step whose midpoint this is; 0: an instant
};

enum class Covariate : std::uint8_t {
  kNothing,
  kTime,
  kX,
  kY,
  kRadius,
  kHeading,
  kCommand,
  kSinceCommand,
  kMotorTime,  ///< motor-on time of the wheel's own motor
  kLeftMotorTime,
  kRightMotorTime,
  kDrivenTime,
  kNeighbours,  ///< number within the radius
  kNearest,     ///< distance to the nearest, at most the radius
  kDensity,
  kBearing,          ///< direction of the nearest, relative to the heading
  kPreviousCommand,  ///< kNoCommand for the first command
  kPreviousLasted,   ///< duration of the previous command, s; 0 if there was none
  kLastTurn,
  kEarlierTurn,          ///< latest turning command before the present command; 0: none
  kCommandCount,         ///< number of changes of the command, that to the present one included
  kSinceRest,            ///< time since the last rest, s
  kMotorTimeDifference,  ///< motor-on time of the right wheel's motor minus that of the left one's, s
  kMotorTimeSum,         ///< motor-on times of both motors added, s
  kTraffic,              ///< of the floor cell, as NeighbourView::traffic
  kRobot,
  kRun,
  kPointDistance,  ///< distance from Axis::point, less its growth
  kAlong,          ///< coordinate along the direction Axis::along_rad
};

/// Name as in model files (Function.Covariate in idl/effects.proto), in lower case; and the unit of its values, empty: a number or a key.
[[nodiscard]] const char* name_of(Covariate);
[[nodiscard]] const char* unit_of(Covariate);

/// The centre of circles that move and grow; see MovingPoint in idl/effects.proto.
struct MovingPoint {
  double x_mm = 0, y_mm = 0;  ///< at the start of the run
  double velocity_x_mm_s = 0, velocity_y_mm_s = 0, growth_mm_s = 0;

  [[nodiscard]] bool stands() const { return velocity_x_mm_s == 0 && velocity_y_mm_s == 0 && growth_mm_s == 0; }
  [[nodiscard]] double x_mm_at(double time_s) const { return x_mm + velocity_x_mm_s * time_s; }
  [[nodiscard]] double y_mm_at(double time_s) const { return y_mm + velocity_y_mm_s * time_s; }
  bool operator==(const MovingPoint&) const = default;
};

/// Value of kPreviousCommand under the first command. The simulator uses a stop there.
inline constexpr double kNoCommand = 4;

struct Axis {
  Covariate of = Covariate::kNothing;
  std::uint8_t radius = 0;       ///< index into kNeighbourRadii_mm; for kTraffic, into MotionModel::cells
  std::uint8_t decay_index = 0;  ///< for motor-on and driven times: 1 + index into kDecayTimes_s; 0: not discounted
  /// For kNeighbours and kDensity up to kListed_mm: each neighbour has the weight ((1 + cos(bearing - toward)) /
  /// 2)^focus.
  std::uint8_t focus = 0;
  std::int16_t toward_deg = 0;
  /// For neighbours: a radius in mm, at most kListed_mm, in place of kNeighbourRadii_mm[radius]; 0: none.
  float within_mm = 0;
  /// For neighbours up to kListed_mm: the robots that count.
  Others others = Others::kAny;
  std::uint32_t only_robot = 0;  ///< 1 + number of the only robot that counts; 0: all
  /// For kPointDistance.
  MovingPoint point = {};
  double along_rad = 0;  ///< for kAlong: from the x axis

  bool operator==(const Axis&) const = default;
};

/// Whether the covariate is one of the robots nearby, with a radius.
[[nodiscard]] constexpr bool is_of_others(const Axis& axis) {
  return axis.of >= Covariate::kNeighbours && axis.of <= Covariate::kBearing;
}
/// Whether only some of the neighbours count.
[[nodiscard]] constexpr bool is_of_some(const Axis& axis) {
  return axis.others != Others::kAny || axis.only_robot > 0;
}
/// The radius of a neighbour covariate, mm.
[[nodiscard]] double reach_mm(const Axis&);
/// `wheel`: 0 left, 1 right; used by kMotorTime only.
[[nodiscard]] double value_of(const Axis&, const Situation&, std::size_t wheel);
[[nodiscard]] double wrapped_angle(double rad);

}  // namespace kilotwin::identify

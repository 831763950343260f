/// What effects look at: one robot at one instant, and numbers of it by the names that model files know.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "clients/identify/data/command_clock.hpp"

namespace kilotwin::identify {

/// Radii within which robots count as neighbours, mm, centre to centre: from touching to well within reach of a message.
inline constexpr std::array<double, 14> kNeighbourRadii_mm = {40,  50,  60,  70,  80,  90,  100,
                                                              110, 120, 130, 140, 150, 175, 200};

/// So many sizes of cells in which a floor may remember where robots went (MotionModel::cells).
inline constexpr std::size_t kFloorCells = 6;

/// One of the other robots, seen from one.
struct OtherRobot {
  float distance_mm = 0;               ///< centre to centre
  float towards_x = 0, towards_y = 0;  ///< of length 1; 0 where it stands at the same place
};
/// Others farther away are not listed.
inline constexpr double kListed_mm = 150;

/// The other robots, seen from one, and what they left on the floor.
struct NeighbourView {
  double nearest_mm = 1e9;                                    ///< centre to centre
  double direction_rad = 0;                                   ///< to the nearest, from the x axis
  std::array<float, kNeighbourRadii_mm.size()> count = {};    ///< within kNeighbourRadii_mm
  std::array<float, kNeighbourRadii_mm.size()> density = {};  ///< sum of (1 - (distance / radius)^2)^2
  std::array<float, kFloorCells> trodden_s = {};  ///< for which driven robots stood in its cell, itself included
  /// Those within kListed_mm, one by one: of this list, from `first_listed` on. Null: they are not listed.
  const std::vector<OtherRobot>* list = nullptr;
  std::uint32_t first_listed = 0, listed = 0;
};

struct Situation {
  double time_s = 0;
  double x_mm = 0, y_mm = 0;  ///< of the disc's centre
  double heading_rad = 0;
  CommandState commands;
  NeighbourView near;
  std::uint32_t robot = 0;  ///< its number
  std::uint32_t run = 0;    ///< place in the set
  double span_s = 0;        ///< of the sub-step of which this is the middle; 0: an instant
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
  kMotorTime,  ///< of the wheel's own motor
  kLeftMotorTime,
  kRightMotorTime,
  kDrivenTime,
  kNeighbours,  ///< within radius
  kNearest,     ///< at most radius
  kDensity,
  kBearing,          ///< to the nearest, from the heading
  kPreviousCommand,  ///< kNoCommand for the first
  kPreviousLasted,   ///< s for which that lasted; 0 where there was none
  kLastTurn,
  kSinceRest,      ///< s since which it is driven without a rest
  kUseDifference,  ///< s for which the right wheel's motor has turned longer than the left one's
  kTrodden,        ///< time that driven robots stood in its cell of the floor
  kRobot,
  kRun,
};

/// What the previous command is where there was none: the simulator takes it for a stop.
inline constexpr double kNoCommand = 4;

struct Axis {
  Covariate of = Covariate::kNothing;
  std::uint8_t radius = 0;  ///< index into kNeighbourRadii_mm; of kTrodden, into MotionModel::cells
  std::uint8_t forget = 0;  ///< with motor and driven times: 1 + index into kForget_s; 0: all counts
  /// With kNeighbours and kDensity within at most kListed_mm: another robot counts ((1 + cos(bearing - toward)) / 2)^focus times.
  std::uint8_t focus = 0;
  std::int16_t toward_deg = 0;
  /// With neighbours: a radius of its own in mm, at most kListed_mm; 0: that of kNeighbourRadii_mm.
  float within_mm = 0;

  bool operator==(const Axis&) const = default;
};

/// Of an axis of neighbours: robots farther away do not count.
[[nodiscard]] double reach_mm(const Axis&);
/// `wheel`: 0 left, 1 right; matters to kMotorTime alone.
[[nodiscard]] double value_of(const Axis&, const Situation&, std::size_t wheel);
[[nodiscard]] double wrapped_angle(double rad);

}  // namespace kilotwin::identify

/// Swarm with the known program in the planar engine, and the floor's reports of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/kilogrid/floor_program.hpp"
#include "idl/model.pb.h"

namespace kilotwin::kilogrid {

/// The boundary in sections of equal length, anticlockwise from the origin.
inline constexpr std::size_t kBoundarySections = 24;
/// The boundary section nearest to a position.
[[nodiscard]] std::size_t boundary_section(const Floor&, double x_mm, double y_mm);

/// Distance from a position to the centre of the nearest boundary cell, mm.
[[nodiscard]] double boundary_cell_distance_mm(const Floor&, double x_mm, double y_mm);

/// Reception between cells and robots.
struct FloorRadio {
  double report_every_s = 2.064;  ///< 63 kilo_ticks
  double range_mm = 46;           ///< distance from the cell centre at which reception is one half
  double blur_mm = 2;             ///< width of the range: reception 1 / (1 + exp((distance - range) / blur))
  double heard = 0.8;             ///< mean reception probability within the range
  double heard_sd = 0.12;         ///< standard deviation between robots
  /// Robots exchange messages in bursts. Their reports then have lower reception, by this factor.
  double while_talking = 0.6;
  double silent_s = 300, talking_s = 225;  ///< mean durations between bursts and of bursts
  /// A module polls its four cells in turn. From one report of a robot to the next it advances by 0..3 cells, the
  /// same number for a while: their probabilities.
  std::array<double, 4> later = {0.25, 0.25, 0.25, 0.25};
  double in_turn = 0.6;       ///< probability that a report meets the cell whose turn it is, rather than any
  double same_pace_s = 120;   ///< mean time for which a robot meets cells with the same advance
  double wall_range_mm = 46;  ///< distance at which robots receive boundary cells
  double wall_heard = 2;      ///< messages per second of boundary cells; at most one per 4 kilo_ticks
  double wall_noise = 5;      ///< of one reading, in mm of distance
};

/// The given inputs of a run.
struct FloorScene {
  std::string name;
  double duration_s = 0;
  std::vector<double> x_mm, y_mm;  ///< initial positions in the floor's frame
};

/// The scene of a measured run: each robot starts in the cell of its first report, without overlaps.
[[nodiscard]] FloorScene scene_of(const FloorRun&, const Floor&, std::uint64_t seed);

/// One run of the model. Deterministic in its arguments.
[[nodiscard]] FloorRun simulate(const FloorScene&, const Floor&, const proto::Model&, const WalkTimes&,
                                const FloorRadio&, std::uint64_t seed);

/// Cell reports of robots at given positions. One object per run.
class FloorReporter {
 public:
  FloorReporter(const Floor&, const FloorRadio&, std::uint32_t robots, std::uint64_t seed);
  /// A robot is at this position in the floor's frame. Times ascend per robot.
  void see(std::uint32_t robot, double time_s, double x_mm, double y_mm);
  [[nodiscard]] FloorRun take(std::string name, double duration_s);

 private:
  /// Number of cells by which a module advances.
  std::uint32_t draw_pace();

  Floor floor_;
  FloorRadio radio_;
  Dice dice_;
  std::vector<double> next_s_, every_s_, heard_, change_s_;
  std::vector<bool> talking_;
  std::vector<std::uint32_t> phase_;  ///< polled cell, relative to the module's initial one
  std::vector<std::uint32_t> pace_;   ///< advance from report to report
  std::vector<FloorTrack> tracks_;
};

}  // namespace kilotwin::kilogrid

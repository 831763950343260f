/// Cell reports: how an instrumented floor hears robots.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/kilogrid/floor_program.hpp"

namespace kilotwin::kilogrid {

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

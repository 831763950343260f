/// Robots with a known program on the floor, by the planar engine: what the floor would write down of them.
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

/// The rim of the floor in equal parts, anticlockwise from the corner at the origin.
inline constexpr std::size_t kRimParts = 24;
/// The part of the rim that is nearest to a place.
[[nodiscard]] std::size_t rim_part(const Floor&, double x_mm, double y_mm);

/// From a place to the middle of the nearest cell of the rim, mm.
[[nodiscard]] double rim_cell_distance_mm(const Floor&, double x_mm, double y_mm);

/// How cells hear robots and robots hear cells.
struct FloorRadio {
  double report_every_s = 2.064;  ///< 63 kilo_ticks
  double range_mm = 46;           ///< at which a cell hears half of the robots' reports, of the cell's middle
  double blur_mm = 2;             ///< of that range: 1 / (1 + exp((distance - range) / blur))
  double heard = 0.8;             ///< mean chance of a robot to be heard within the range
  double heard_sd = 0.12;         ///< of that chance between robots
  /// Robots talk to each other for a while now and then; their reports are then lost more often, by this factor.
  double while_talking = 0.6;
  double silent_s = 300, talking_s = 225;  ///< mean times between and of that
  /// A module listens to one of its four cells at a time, in turn. From one report of a robot to the next it goes on by 0..3
  /// cells, the same for a while: these are the chances of each.
  std::array<double, 4> later = {0.25, 0.25, 0.25, 0.25};
  double in_turn = 0.6;       ///< chance of a report to meet the cell whose turn it is, not just any
  double same_pace_s = 120;   ///< mean time for which a robot meets cells by the same number on
  double wall_range_mm = 46;  ///< at which robots hear cells of the rim
  double wall_heard = 2;      ///< such messages a second; at most one in 4 kilo_ticks
  double wall_noise = 5;      ///< of one reading, in mm of distance
};

/// What is given of a run, not fitted.
struct FloorScene {
  std::string name;
  double duration_s = 0;
  std::vector<double> x_mm, y_mm;  ///< where robots are at the start, in the floor's frame
};

/// The scene of a measured run: each robot in the cell in which it was heard first, nobody on top of another.
[[nodiscard]] FloorScene scene_of(const FloorRun&, const Floor&, std::uint64_t seed);

/// One run of the model. The same bits for the same arguments.
[[nodiscard]] FloorRun simulate(const FloorScene&, const Floor&, const proto::Model&, const WalkTimes&,
                                const FloorRadio&, std::uint64_t seed);

/// The floor writes down what it hears of robots at given places: one object per run.
class FloorReporter {
 public:
  FloorReporter(const Floor&, const FloorRadio&, std::uint32_t robots, std::uint64_t seed);
  /// A robot is at this place in the floor's frame at this time; ascending times for each robot.
  void see(std::uint32_t robot, double time_s, double x_mm, double y_mm);
  [[nodiscard]] FloorRun take(std::string name, double duration_s);

 private:
  /// By how many cells a module goes on.
  std::uint32_t draw_pace();

  Floor floor_;
  FloorRadio radio_;
  Dice dice_;
  std::vector<double> next_s_, every_s_, heard_, change_s_;
  std::vector<bool> talking_;
  std::vector<std::uint32_t> phase_;  ///< which cell modules listen to, but for what each began with
  std::vector<std::uint32_t> pace_;   ///< by how many cells it goes on from report to report
  std::vector<FloorTrack> tracks_;
};

}  // namespace kilotwin::kilogrid

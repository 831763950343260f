/// Robots with a known program on the floor, by the planar engine: what the floor would write down of them.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/kilogrid/floor_program.hpp"
#include "idl/model.pb.h"

namespace kilotwin::kilogrid {

/// How cells hear robots and robots hear cells.
struct FloorRadio {
  double report_every_s = 2.064;  ///< 63 kilo_ticks
  double range_mm = 46;           ///< at which a cell hears half of the robots' reports, of the cell's middle
  double blur_mm = 2;             ///< of that range: 1 / (1 + exp((distance - range) / blur))
  double heard = 0.8;             ///< mean chance of a robot to be heard within the range
  double heard_sd = 0.12;         ///< of that chance between robots
  double wall_range_mm = 46;      ///< at which robots hear cells of the rim
  double wall_heard = 1;          ///< chance of such a message to arrive
  double wall_noise = 5;          ///< of one reading, in mm of distance
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
  Floor floor_;
  FloorRadio radio_;
  Dice dice_;
  std::vector<double> next_s_, every_s_, heard_;
  std::vector<FloorTrack> tracks_;
};

}  // namespace kilotwin::kilogrid

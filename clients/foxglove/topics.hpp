/// A run in the messages of Foxglove (docs.foxglove.dev/docs/sdk/schemas), which Lichtblick and Rerun know too. Topics, with time
/// stamps of simulated time:
///   /scene      foxglove.SceneUpdate: walls, obstacles, movable bodies
///   /robots     foxglove.PointCloud: all robots, in the colours of their LEDs
///   /poses      foxglove.PosesInFrame: all robots, with headings
///   /counters   kilotwin.mcap.SwarmCounters: numbers for plots
///   /variables/NAME  kilotwin.mcap.RobotVariable: a recorded variable, one value per robot
///   /log        foxglove.Log: inputs of the run, lines that robots print, and the end of the run
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/plan/world.hpp"

namespace google::protobuf {
class Message;
}

namespace kilotwin::foxglove {

/// Simulated ns since tick 0.
using Time_ns = std::uint64_t;

/// Where messages go: a file, viewers.
class Sink {
 public:
  virtual ~Sink() = default;
  /// `schema`: a FileDescriptorSet, serialised. `matter`: how many of its newest messages matter; a viewer that falls behind
  /// needs no others.
  [[nodiscard]] virtual std::uint16_t add_channel(std::string_view topic, std::string_view schema_name,
                                                  std::string_view schema, std::size_t matter) = 0;
  virtual void write(std::uint16_t channel, Time_ns time, std::string_view message) = 0;
};

/// The swarm at one instant; columns of equal length per robot, and per movable body.
struct State {
  Time_ns time = 0;
  std::span<const double> x_mm, y_mm, heading_rad;
  std::span<const std::uint8_t> led, life_cycle;
  std::span<const double> movable_x_mm, movable_y_mm, movable_heading_rad;
};

class Topics {
 public:
  enum class Level : std::uint8_t { kInfo, kError };

  /// Adds the channels.
  Topics(Sink& sink, World world);

  /// The first state writes the arena too. The mean square displacement is that from the first state.
  void state(const State& state);
  /// `speaker`: who says it, such as "robot 17".
  void log(Time_ns time, Level level, const std::string& text, std::string_view speaker = "kilotwin");
  /// A variable's values at one instant; `robot` and `value` have equal lengths. The first of a name adds its channel.
  void variable(Time_ns time, const std::string& name, std::span<const std::uint32_t> robot,
                std::span<const double> value);

 private:
  void write(std::uint16_t channel, Time_ns time, const google::protobuf::Message& message);
  void write_scene(const State& state);
  void write_robots(const State& state);
  void write_poses(const State& state);
  void write_counters(const State& state);

  Sink& sink_;
  const World world_;
  const std::uint16_t scene_, robots_, poses_, counters_, log_;
  std::map<std::string, std::uint16_t, std::less<>> variables_;  // channels by name
  std::vector<double> first_x_mm_, first_y_mm_;
  bool any_ = false;
  std::string bytes_;  // reused
};

}  // namespace kilotwin::foxglove

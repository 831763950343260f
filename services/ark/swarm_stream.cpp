#include "services/ark/swarm_stream.hpp"

#include <algorithm>
#include <string>

#include "core/base/clocks.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::ark {
namespace {

constexpr double kMostPerSecond = 60;
/// Bytes per second that states of large swarms may take, and bytes per robot in a state.
constexpr double kMostBytesPerSecond = 32e6, kBytesPerRobot = 28;
constexpr auto kRepeatEvery = std::chrono::milliseconds(500);

/// Sequences of a sample that is only written borrow the columns.
template <class Sequence, class Value> void borrow(Sequence& sequence, const std::vector<Value>& column) {
  sequence._buffer = const_cast<Value*>(column.data());
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(column.size());
}

}  // namespace

SwarmStream::SwarmStream(const RunPlan& plan, const dds::Participant& participant)
    : plan_(plan),
      description_(participant, topics::run_description()),
      states_(participant, topics::swarm()),
      interval_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
          std::max(1 / kMostPerSecond, plan.robots() * kBytesPerRobot / kMostBytesPerSecond)))) {
  const std::string experiment = plan.manifest().experiment().SerializeAsString();
  const std::vector<std::uint8_t> bytes(experiment.begin(), experiment.end());
  PublicRunDescription description{};
  description.run = plan.run();
  plan.experiment_name().copy(description.name, sizeof description.name - 1);
  description.seed = plan.seed();
  description.tick_s = plan.tick_length.seconds();
  description.last_tick = plan.last_tick.count();
  description.robots = plan.robots();
  description.movables = plan.movables();
  borrow(description.experiment, bytes);
  description_.write(description);
}

void SwarmStream::offer(const SwarmView& swarm, bool last) {
  const auto now = Clock::now();
  if (now < next_ && !last) return;
  // A little less than the interval: ticks that come just as often as states may be are all written.
  next_ = std::max(next_ + interval_, now + interval_ * 3 / 4);
  if (states_.readers() > 0) write(swarm);
}

void SwarmStream::repeat(const SwarmView& swarm) {
  if (swarm.tick < Tick{0} || Clock::now() < written_ + kRepeatEvery || states_.readers() == 0) return;
  write(swarm);
}

void SwarmStream::write(const SwarmView& swarm) {
  written_ = Clock::now();
  PublicSwarmState state{};
  state.run = plan_.run();
  state.tick = swarm.tick.count();
  state.time_s = plan_.tick_length.seconds_at(swarm.tick);
  state.wall_ns = utc_ns();
  borrow(state.x_mm, swarm.x_mm);
  borrow(state.y_mm, swarm.y_mm);
  borrow(state.heading_rad, swarm.heading_rad);
  borrow(state.led, swarm.led);
  borrow(state.life_cycle, swarm.life_cycle);
  borrow(state.motor_left, swarm.motor_left);
  borrow(state.motor_right, swarm.motor_right);
  borrow(state.movable_x_mm, swarm.movable_x_mm);
  borrow(state.movable_y_mm, swarm.movable_y_mm);
  borrow(state.movable_heading_rad, swarm.movable_heading_rad);
  states_.write(state);
}

}  // namespace kilotwin::ark

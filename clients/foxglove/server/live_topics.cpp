#include "clients/foxglove/server/live_topics.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::foxglove {

void LiveTopics::serve() {
  switch (observer_.wait(std::chrono::milliseconds(50))) {
    case observe::News::kRunBegan: return begin();
    case observe::News::kState: return write_state();
    case observe::News::kRunEnded:
      if (topics_) topics_->log(time_, Topics::Level::kInfo, "the run has ended");
      topics_.reset();
      say("kilotwin: the run has ended");
      return;
    case observe::News::kNothing: return;
  }
}

void LiveTopics::begin() {
  const observe::RunFacts& facts = *observer_.run();
  try {
    World world(*facts.experiment);
    server_.begin(fmt::format("{:016x}", facts.run));
    topics_.emplace(server_, std::move(world));
    time_ = 0;
    say(fmt::format("kilotwin: sees run {}, {} robots", one_line(facts.name, 128), facts.robots));
  } catch (const std::invalid_argument& error) {
    warn(fmt::format("kilotwin: run {} cannot be shown: {}", one_line(facts.name, 128), one_line(error.what())));
  }
}

void LiveTopics::write_state() {
  // Nobody looks: nothing is encoded. The first state is needed for displacements from it.
  if (!topics_ || (server_.viewers() == 0 && time_ != 0)) return;
  const observe::SwarmAt& at = *observer_.state();
  State state;
  state.time = time_ = static_cast<Time_ns>(std::llround(at.time_s * 1e9));
  state.x_mm = at.swarm.x_mm;
  state.y_mm = at.swarm.y_mm;
  state.heading_rad = at.swarm.heading_rad;
  state.led = at.swarm.led;
  state.life_cycle = at.swarm.life_cycle;
  state.movable_x_mm = at.swarm.movable_x_mm;
  state.movable_y_mm = at.swarm.movable_y_mm;
  state.movable_heading_rad = at.swarm.movable_heading_rad;
  topics_->state(state);
}

}  // namespace kilotwin::foxglove

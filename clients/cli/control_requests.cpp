#include "clients/cli/control_requests.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <limits>
#include <vector>

#include "clients/observe/observer.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

using nlohmann::ordered_json;
using Status = RunControl::Status;

/// The station sees the files of its own disk only; of others it knows once all services have stepped beyond the tick.
constexpr const char* kSavedOnceItGoesOn =
    "; if its services have disks of their own, a paused run counts as saved once it goes on: kilotwin control "
    "step 1";

Status act(RunControl& control, const ControlRequest& request, const Status& before) {
  const auto ask = [&](kilotwin_open_RunCommand command) {
    control.send(command, request.steps, request.patience);
  };
  if (request.command == "pause") {
    ask(kilotwin_open_PAUSE_RUN);
    return control.await([](const Status& now) { return now.phase == kilotwin_open_PAUSED; }, "pause",
                         request.patience);
  }
  if (request.command == "continue") {
    ask(kilotwin_open_CONTINUE_RUN);
    return control.await([](const Status& now) { return now.phase == kilotwin_open_RUNNING; }, "continue",
                         request.patience);
  }
  if (request.command == "step") {
    ask(kilotwin_open_STEP_RUN);
    return control.await(
        [&](const Status& now) {
          return now.phase == kilotwin_open_PAUSED && now.tick >= before.tick + request.steps;
        },
        "take these steps", request.patience);
  }
  if (request.command == "stop") {
    ask(kilotwin_open_STOP_RUN);
    return control.await([](const Status& now) { return is_over(now.phase); }, "end", request.patience);
  }
  if (request.command == "place") {
    control.place(*request.place, request.patience);
    return control.find(request.patience);
  }
  ask(kilotwin_open_CHECKPOINT_RUN);
  // A paused run may have saved its state at this tick before. One that runs saves a later one.
  const bool is_paused = before.phase == kilotwin_open_PAUSED;
  const std::int64_t least = is_paused ? before.tick : std::max(before.tick, before.saved_tick) + 1;
  return control.await([&](const Status& now) { return now.saved_tick > 0 && now.saved_tick >= least; },
                       "save its state", request.patience, is_paused ? kSavedOnceItGoesOn : "");
}

ControlRequest request_of(const ordered_json& line, std::chrono::duration<double> patience) {
  if (!line.is_object() || line.size() != 1)
    throw UserError(
        "a request is a JSON object with one member: status, state, pause, continue, step, stop, checkpoint or "
        "place");
  ControlRequest request;
  request.command = line.begin().key();
  request.patience = patience;
  const ordered_json& with = line.begin().value();
  const auto whole = [](const ordered_json& value, const char* what) {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
      throw UserError(fmt::format("{}: {} is no whole number, at least 0", what, value.dump()));
    return value.get<std::uint32_t>();
  };
  if (request.command == "step") {
    request.steps = whole(with, "step");
    if (request.steps == 0) throw UserError("step: give a number of ticks, at least 1");
  } else if (request.command == "place") {
    const bool movable = with.contains("movable");
    request.place =
        Relocation{movable,
                   whole(with.at(movable ? "movable" : "robot"), "place"),
                   {with.at("x_mm").get<double>(), with.at("y_mm").get<double>(), with.value("heading_rad", 0.0)}};
  } else {
    for (const char* known : {"status", "state", "pause", "continue", "stop", "checkpoint"}) {
      if (request.command == known) return request;
    }
    throw UserError(fmt::format(
        "there is no request {}; there are status, state, pause, continue, step, stop, checkpoint and place",
        request.command));
  }
  return request;
}

/// States of the swarm as they come.
class States {
 public:
  explicit States(std::uint32_t domain) : observer_({domain, {}}) {}

  /// The newest state, of tick `from` or later. Waits for it within the patience.
  ordered_json newest(std::int64_t from, std::chrono::duration<double> patience) {
    using namespace std::chrono_literals;
    const auto until = std::chrono::steady_clock::now() + patience;
    const auto awaited = [&] {
      return observer_.state() == nullptr || observer_.state()->swarm.tick.count() < from;
    };
    while (observer_.wait(awaited() ? 20ms : 0ms) != observe::News::kNothing || awaited()) {
      if (awaited() && std::chrono::steady_clock::now() > until)
        throw RunError(fmt::format("no state of the swarm from tick {} on within {:g} s", from, patience.count()));
    }
    const observe::SwarmAt& state = *observer_.state();
    const SwarmView& swarm = state.swarm;
    ordered_json led = ordered_json::array();
    for (const std::uint8_t colour : swarm.led) led.push_back({colour & 3, colour >> 2 & 3, colour >> 4 & 3});
    return {{"tick", swarm.tick.count()},
            {"time_s", state.time_s},
            {"x_mm", swarm.x_mm},
            {"y_mm", swarm.y_mm},
            {"heading_rad", swarm.heading_rad},
            {"led", std::move(led)},
            {"life_cycle", swarm.life_cycle},
            {"body_x_mm", swarm.movable_x_mm},
            {"body_y_mm", swarm.movable_y_mm},
            {"body_heading_rad", swarm.movable_heading_rad}};
  }

 private:
  observe::Observer observer_;
};

}  // namespace

Status carry_out(RunControl& control, const ControlRequest& request) {
  Status status = control.find(request.patience);
  if (request.command == "status") return status;
  if (is_over(status.phase))
    throw RunError(fmt::format("the run {} is over; there is nothing to {}", status.name, request.command));
  status = act(control, request, status);
  if (is_over(status.phase) && request.command != "stop")
    throw RunError(fmt::format("the run {} came to its end before it could {}", status.name, request.command));
  return status;
}

const char* name_of(kilotwin_open_RunPhase phase) {
  switch (phase) {
    case kilotwin_open_STARTING: return "starting";
    case kilotwin_open_RUNNING: return "running";
    case kilotwin_open_PAUSED: return "paused";
    case kilotwin_open_ENDED: return "ended";
    case kilotwin_open_BROKEN: return "broken";
  }
  return "unknown";
}

ordered_json in_json(const Status& status) {
  return {{"run", fmt::format("{:016x}", status.run)},
          {"name", status.name},
          {"phase", name_of(status.phase)},
          {"tick", status.tick},
          {"last_tick", status.last_tick},
          {"simulated_s", status.simulated_s},
          {"wall_s", status.wall_s},
          {"robots", status.robots},
          {"robots_failed", status.robots_failed},
          {"sent", status.sent},
          {"received", status.received},
          {"note", status.note},
          {"saved_tick", status.saved_tick}};
}

namespace {

/// The newest state. A paused run shows states of the tick at which it stands twice a second; an earlier one is older than the
/// status that the last request has answered.
ordered_json newest_state(RunControl& control, States& states, std::chrono::duration<double> patience) {
  const Status status = control.find(patience);
  return states.newest(status.phase == kilotwin_open_PAUSED ? status.tick : 0, patience);
}

}  // namespace

void serve_requests(std::uint32_t domain, std::chrono::duration<double> patience) {
  RunControl control(domain);
  States states(domain);
  const auto say_line = [](const ordered_json& line) {
    std::cout << line.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << std::endl;
  };
  say_line(in_json(control.find(patience)));
  for (std::string line; std::getline(std::cin, line);) {
    try {
      const ControlRequest request = request_of(ordered_json::parse(line), patience);
      say_line(request.command == "state" ? newest_state(control, states, patience)
                                          : in_json(carry_out(control, request)));
    } catch (const UserError& error) {
      say_line({{"error", error.what()}, {"status", 2}});
    } catch (const RunError& error) {
      say_line({{"error", error.what()}, {"status", 1}});
    } catch (const ordered_json::exception& error) {
      say_line({{"error", fmt::format("the request is not as it should be: {}", error.what())}, {"status", 2}});
    }
  }
}

}  // namespace kilotwin::cli

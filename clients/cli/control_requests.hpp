/// Requests that steer a run: the commands of `kilotwin control`, one by one or as lines of JSON.
#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "clients/cli/run_control.hpp"

namespace kilotwin::cli {

struct ControlRequest {
  std::string command;  ///< pause, continue, step, stop, checkpoint, place or status
  std::uint32_t steps = 0;
  std::optional<Relocation> place;  ///< with place
  std::chrono::duration<double> patience{10};
};

/// Does it and waits for its effect. Returns the run's status then. Throws RunError after the patience, or where the run is over.
[[nodiscard]] RunControl::Status carry_out(RunControl& control, const ControlRequest& request);

/// "starting", "running", "paused", "ended" or "broken".
[[nodiscard]] const char* name_of(kilotwin_open_RunPhase phase);
[[nodiscard]] nlohmann::ordered_json in_json(const RunControl::Status& status);

/// Answers requests on standard input, each a line of JSON, until it ends: docs/how-to/join.md.
void serve_requests(std::uint32_t domain, std::chrono::duration<double> patience);

}  // namespace kilotwin::cli

/// The worker: the process in which a local run is executed. If a robot's program crashes it, the parent process survives and
/// restarts the run from its last checkpoint.
///
/// It is a fork() of its own and no os::Process: that starts another program, but the worker continues in this one, with the
/// plan, the claimed run directory and standard input as they are.
#pragma once

#include <optional>

#include "core/os/process.hpp"

namespace kilotwin::cli {

/// Forks the worker and waits for its end. Returns nothing in the worker, which then executes the run. Returns the worker's end in
/// the calling process. Forwards SIGINT and SIGTERM to the worker, which then ends in order. The worker does not outlive its
/// parent. Requires that no other thread runs. Throws RunError if fork() fails.
[[nodiscard]] std::optional<os::ProcessEnd> end_of_worker();

}  // namespace kilotwin::cli

/// The launcher starts the services of a federated run as processes on this machine, shows the progress of the run, and ends all
/// services. It is not a federate; services started by hand give the same run.
#pragma once

#include <string>
#include <vector>

#include "clients/cli/prepare.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

struct LaunchOptions {
  std::uint32_t domain = 0;
  double start_monotonic_s = 0;  ///< start time of the command, steady clock, s
  double give_up_after_s = 0;    ///< longest wait of services for each other without progress; 0: no limit
  bool show_progress = true;
  bool realtime = false;             ///< services take precedence over other programs of the machine
  std::vector<std::string> monitor;  ///< options of the residual monitor, for the station; empty: none
};

/// Runs the services until all have ended, and returns the exit status. Prints the first service that was lost or failed to stderr
/// immediately. Throws RunError if a service cannot be started.
int launch(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options);

}  // namespace kilotwin::cli

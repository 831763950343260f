/// Starts the services of a federated run as processes of this machine, shows the progress of the run, and ends all services.
/// It takes no part in the run: the services could as well be started by hand.
#pragma once

#include "clients/cli/prepare.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

struct LaunchOptions {
  std::uint32_t domain = 0;
  double start_monotonic_s = 0;  ///< when the command was given
  double give_up_after_s = 0;    ///< how long services wait for each other without progress; 0: for ever
  bool show_progress = true;
};

/// Returns the exit status when all services have ended. Reports the first service that was lost or failed on stderr, at once.
/// Throws RunError if a service cannot be started.
int launch(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options);

}  // namespace kilotwin::cli

/// Starts the services of a federated run as processes of this machine, shows how the run goes, and sees to it that none is
/// left behind. It has no part in the run: what it starts could as well be started by hand.
#pragma once

#include "clients/cli/prepare.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

struct LaunchOptions {
  std::uint32_t domain = 0;
  double start_monotonic_s = 0;  ///< when the command was given
  bool show_progress = true;
};

/// Returns the exit status when all services have left. The first service that was lost or failed is named on stderr as soon
/// as it is known. Throws RunError where a service cannot be started.
int launch(const RunPlan& plan, const recorder::RunDirectory& directory, const LaunchOptions& options);

}  // namespace kilotwin::cli

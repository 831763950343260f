/// A local run, executed in the calling process.
#pragma once

#include <cstdint>

#include "clients/recorder/run_directory.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

/// Executes a prepared run to its end and writes its results into its directory. `started_s`: start time of the program, steady
/// clock, s. Throws UserError and RunError.
void run_in_this_process(const RunPlan& plan, const recorder::RunDirectory& directory, std::uint32_t threads,
                         bool quiet, double started_s);

}  // namespace kilotwin::cli

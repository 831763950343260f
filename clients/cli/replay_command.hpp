/// `kilotwin replay RUN --verify --monitor`: steps a recorded run again and compares every state hash and every recorded state.
/// The residual monitor compares its tracked robots with the model.
#pragma once

#include <filesystem>
#include <string>

#include "clients/cli/run_monitor.hpp"

namespace kilotwin::cli {

/// Returns 0 if all agree. Throws RunError with the first tick that differs, or with the reason if the recording is damaged or too
/// short; UserError if the directory holds no run. `partitions`: "CxR", or empty for those of the recorded run.
int replay_command(const std::filesystem::path& run, const std::string& partitions, bool quiet,
                   const MonitorOptions& monitor = {});

}  // namespace kilotwin::cli

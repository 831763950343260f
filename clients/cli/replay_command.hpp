/// `kilotwin replay RUN --verify`: steps a recorded run again and compares every tick's state hash.
#pragma once

#include <filesystem>

namespace kilotwin::cli {

/// Returns 0 where every hash agrees. Throws RunError that names the first tick that differs, UserError for what is no run.
int replay_command(const std::filesystem::path& run, bool quiet);

}  // namespace kilotwin::cli

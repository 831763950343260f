/// What a sweep has on disk, so that it can go on after an interruption.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/sweep_points.hpp"
#include "clients/cli/sweep_runs.hpp"

namespace kilotwin::cli {

/// What must be alike where a sweep goes on: experiment, points, options of its runs. Seeds may differ.
[[nodiscard]] std::string plan_text(const std::filesystem::path& experiment, const std::vector<SweepPoint>& points,
                                    const std::vector<std::string>& words);
/// Writes it to DIR/sweep.json. Throws RunError.
void write_plan(const std::filesystem::path& directory, const std::string& plan);
/// Throws UserError where the directory holds no sweep, or another one.
void check_plan(const std::filesystem::path& directory, const std::string& plan);

/// Whether the run's directory holds a run of its seed that came to its end without failure.
[[nodiscard]] bool is_complete(const SweepRun& run);
/// Removes what an interrupted run left behind, if anything.
void remove_unfinished(const SweepRun& run);

}  // namespace kilotwin::cli

/// The report of a run, report.html.
#pragma once

#include <cstdint>

#include "clients/recorder/run_directory.hpp"

namespace kilotwin::cli {

/// The page of a run that has ended, made of the files in its directory: summary, recording, manifest, experiment and picture. It has
/// no curves, and says so, where gnuplot is not installed. Throws UserError where a file is missing or damaged.
[[nodiscard]] std::string run_report(const recorder::RunDirectory& directory);

/// States times robots that a run reads for its curves: that takes some 3 s.
inline constexpr std::uint64_t kMostRobotStates = 10'000'000;

/// Writes it to report.html of the run directory. Of a recording with more than `most_robot_states` states times robots, the curves
/// are of every n-th state, and the page says so. Does nothing where the run ended before its summary. A page that cannot be
/// written is a warning: it changes nothing of the run's outcome.
void write_run_report(const recorder::RunDirectory& directory, std::uint64_t most_robot_states = kMostRobotStates);

}  // namespace kilotwin::cli

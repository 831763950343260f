/// What `kilotwin run` leaves for people: report.html.
#pragma once

#include "clients/recorder/run_directory.hpp"

namespace kilotwin::cli {

/// The page of a run that has ended, made of the files in its directory: summary, recording, manifest, experiment and picture. It has
/// no curves, and says so, where gnuplot is not installed. Throws UserError where a file is missing or damaged.
[[nodiscard]] std::string run_report(const recorder::RunDirectory& directory);

/// Writes it to report.html of the run directory; without curves if they would take more than some seconds. Does nothing where the
/// run ended before its summary. A page that cannot be written is a warning: it changes nothing of the run's outcome.
void write_run_report(const recorder::RunDirectory& directory);

}  // namespace kilotwin::cli

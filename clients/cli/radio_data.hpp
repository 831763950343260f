/// Counts of messages between robots, for `kilotwin identify`: the fit of clients/identify/radio as one more kind of data.
#pragma once

#include <filesystem>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Whether the directory holds runs of the kind comm_tau*_run*.dat.
[[nodiscard]] bool has_radio_runs(const std::filesystem::path& directory);

/// Fits the radio; the fit's own files (tables, figures, one model per set of robots) stay in out/radio. There are no
/// predictions of places. Throws UserError where a file does not parse.
[[nodiscard]] identify::Identified identify_radio_runs(const std::filesystem::path& train,
                                                       const std::filesystem::path& test,
                                                       const std::filesystem::path& out, const identify::Options&);

}  // namespace kilotwin::cli

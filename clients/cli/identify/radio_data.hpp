/// Message counts between robots as input of `kilotwin identify`: the fit in clients/identify/radio.
#pragma once

#include <filesystem>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Whether the directory holds files comm_tau*_run*.dat.
[[nodiscard]] bool has_radio_runs(const std::filesystem::path& directory);

/// Fits the radio. Tables, figures and one model per robot set are in out/radio. There are no position
/// predictions. Throws UserError on malformed files.
[[nodiscard]] identify::Identified identify_radio_runs(const std::filesystem::path& train,
                                                       const std::filesystem::path& test,
                                                       const std::filesystem::path& out, const identify::Options&);

}  // namespace kilotwin::cli

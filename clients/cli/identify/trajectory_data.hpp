/// Trajectories with or without commands as input of `kilotwin identify`.
#pragma once

#include <filesystem>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Reads both sets, or imports them into `out`; excludes faults of the data; fits. Throws UserError on malformed or
/// implausible data.
[[nodiscard]] identify::Identified identify_trajectories(const std::filesystem::path& train,
                                                         const std::filesystem::path& test,
                                                         const std::filesystem::path& out,
                                                         const identify::Options&);

}  // namespace kilotwin::cli

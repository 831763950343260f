/// Measured trajectories as input of `kilotwin identify`: the command's own checks before the pure engine.
#pragma once

#include "clients/cli/identify/data_kinds.hpp"

namespace kilotwin::cli {

/// The study of measured tracks. Sets that are not in trajectories.csv are also written into `out`, for users to look at:
/// imported-train/ and imported-test/. Throws UserError on malformed or implausible files.
[[nodiscard]] std::unique_ptr<identify::Study> read_tracks(const DataPlaces&, const identify::Options&);

}  // namespace kilotwin::cli

/// Measured data other than trajectories: Kilogrid runs, bristle plate tracks, radio counts.
#pragma once

#include <filesystem>
#include <optional>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Identifies with the method for the kind of data in `train`. Nothing if it holds trajectories, or no known kind.
/// `test` may be empty. Throws UserError if the two directories hold different kinds.
[[nodiscard]] std::optional<identify::Identified> identify_other_data(const std::filesystem::path& train,
                                                                      const std::filesystem::path& test,
                                                                      const std::filesystem::path& out,
                                                                      const identify::Options&);

}  // namespace kilotwin::cli

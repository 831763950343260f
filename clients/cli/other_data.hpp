/// Measured data other than trajectories, by the same command: runs of an instrumented floor, and robots that are always on.
#pragma once

#include <filesystem>
#include <optional>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// What was identified, by whatever makes of the kind of data in `train`; none where it holds trajectories or nothing that is
/// known. `test` may be empty. Throws UserError where the two directories hold different kinds.
[[nodiscard]] std::optional<identify::Identified> identify_other_data(const std::filesystem::path& train,
                                                                      const std::filesystem::path& test,
                                                                      const std::filesystem::path& out,
                                                                      const identify::Options&);

}  // namespace kilotwin::cli

/// Measured data other than trajectories: Kilogrid runs, bristle plate tracks, radio counts.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "clients/identify/identify.hpp"

namespace kilotwin::cli {

/// Throws UserError if the path holds no data of a known kind; the line says what is there and what is expected. `option`:
/// the option that named the path.
void demand_known_data(const std::string& option, const std::filesystem::path& data);

/// Identifies with the method for the kind of data in `train`. Nothing if it holds trajectories.
/// `test` may be empty. Throws UserError if the two directories hold different kinds.
[[nodiscard]] std::optional<identify::Identified> identify_other_data(const std::filesystem::path& train,
                                                                      const std::filesystem::path& test,
                                                                      const std::filesystem::path& out,
                                                                      const identify::Options&);

}  // namespace kilotwin::cli

/// Small data sets with oddities, at random: what trackers, scripts and typing errors produce.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::truth {

/// The text of the files of one set, and the oddities in it.
struct OddSet {
  std::string trajectories;
  std::string commands;               ///< empty: no commands.csv
  std::vector<std::string> oddities;  ///< in words
};

/// Up to six robots, three runs and 90 s. Equal seeds give equal sets.
[[nodiscard]] OddSet odd_set(std::uint64_t seed);

/// Writes trajectories.csv and commands.csv.
void write_odd_set(const OddSet&, const std::filesystem::path& directory);

}  // namespace kilotwin::truth

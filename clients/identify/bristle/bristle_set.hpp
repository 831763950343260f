/// Bristle plate tracks: robots with constantly driven motors and without commands, such as a Kilobot on a bristle
/// plate. Files `NAME.csv` or `NAME.csv.gz` with the columns run, robot, time_s, x_mm, y_mm, heading_rad. Each run
/// has its own power and table.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::bristle {

struct BristleRun {
  std::string name;
  std::uint32_t robot = 0;
  std::vector<double> time_s, x_mm, y_mm, heading_rad;  ///< heading as the tracker reports it
  std::size_t dropped = 0;                              ///< rows with implausible positions

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// Whether all CSV files of the directory are of this kind.
[[nodiscard]] bool has_bristle_runs(const std::filesystem::path& directory);
/// All runs of all files, by name. Throws UserError with file, line and column.
[[nodiscard]] std::vector<BristleRun> read_bristle_runs(const std::filesystem::path& directory);
/// Removes rows with positions that no robot can reach.
void drop_implausible_rows(BristleRun&);

}  // namespace kilotwin::bristle

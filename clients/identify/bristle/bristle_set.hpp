/// Tracks of robots whose motors are always on and that no program steers, such as a Kilobot that rides a bristle plate: files
/// `NAME.csv` or `NAME.csv.gz` with the columns run, robot, time_s, x_mm, y_mm, heading_rad and no commands. Each run has its own
/// power and its own table.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::bristle {

struct RiddenRun {
  std::string name;
  std::uint32_t robot = 0;
  std::vector<double> time_s, x_mm, y_mm, heading_rad;  ///< heading as the tracker says it
  std::size_t dropped = 0;                              ///< rows that lay where the robot cannot have been

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// Whether the directory holds such files and nothing else that is a CSV file.
[[nodiscard]] bool has_ridden_runs(const std::filesystem::path& directory);
/// All runs of all files, by name. Throws UserError with file, line and column.
[[nodiscard]] std::vector<RiddenRun> read_ridden_runs(const std::filesystem::path& directory);
/// Takes out rows to which the robot would have had to jump.
void drop_jumps(RiddenRun&);

}  // namespace kilotwin::bristle

/// A CSV file of initial poses: the header x_mm,y_mm,heading_rad (or heading_deg), then one row per robot.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace kilotwin {

struct CsvPoses {
  std::vector<double> x_mm, y_mm;
  std::vector<double> heading_rad;  ///< in [-pi, pi)
  std::vector<std::uint32_t> line;  ///< of the file, from 1
};

/// Blank lines are skipped; lines may end in CR LF. Throws UserError that names a place in the file, or begins with
/// `named_at` if the file cannot be read.
[[nodiscard]] CsvPoses read_poses_csv(const std::filesystem::path& file, std::string_view named_at);

}  // namespace kilotwin

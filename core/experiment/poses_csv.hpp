/// A CSV file of initial poses: the columns x_mm, y_mm and heading_rad (or heading_deg), one row per robot.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace kilotwin {

struct CsvPoses {
  std::vector<double> x_mm, y_mm;
  std::vector<double> heading_rad;  ///< in [-pi, pi)
  std::vector<std::uint32_t> line;  ///< line of the file, from 1
};

/// Throws UserError with a place in the file. If the file cannot be read, the error begins with `named_at`, the place that names it.
[[nodiscard]] CsvPoses read_poses_csv(const std::filesystem::path& file, std::string_view named_at);

}  // namespace kilotwin

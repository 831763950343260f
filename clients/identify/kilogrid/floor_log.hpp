/// Kilogrid logs: which cell received which robot, and when. Files `NAME.csv` or `NAME.csv.gz` with columns
/// time_s, robot, x_mm, y_mm. x, y is the cell centre; the origin is a corner of the floor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::kilogrid {

/// Reports of one robot in order of time. If several cells receive it at once, each has a row.
struct FloorTrack {
  std::uint32_t robot = 0;  ///< number in the file
  std::vector<double> time_s, x_mm, y_mm;

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// A robot whose rows are not plausible.
struct FloorFault {
  enum class Kind : std::uint8_t { kFewReports, kTwoPlaces };
  std::uint32_t robot;
  Kind kind;
  std::string reason;  ///< in words
};

struct FloorRun {
  std::string name;
  double duration_s = 0;
  std::vector<FloorTrack> tracks;
  std::vector<FloorFault> faults;  ///< excluded from tracks
};

/// Default floor: the known data sets have 20 x 40 cells.
struct Floor {
  double width_mm = 1000, height_mm = 2000, cell_mm = 50;
};

/// Whether the directory holds Kilogrid runs: CSV files that all have the four columns.
[[nodiscard]] bool has_floor_runs(const std::filesystem::path& directory);

/// All runs of the directory, by name. Robots in two places at once, or with very few reports, become faults.
/// Throws UserError with file and line.
[[nodiscard]] std::vector<FloorRun> read_floor_runs(const std::filesystem::path& directory, const Floor& = {});

/// One run from its text. `name` is used in errors.
[[nodiscard]] FloorRun parse_floor_run(const std::string& text, const std::string& name, const Floor& = {});

}  // namespace kilotwin::kilogrid

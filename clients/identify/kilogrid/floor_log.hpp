/// What an instrumented floor wrote down: which robot was heard in which cell, and when. Files `NAME.csv` or `NAME.csv.gz`
/// with the columns time_s, robot, x_mm, y_mm; x, y is the middle of a cell, the floor's corner the origin.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::kilogrid {

/// Where one robot was heard, in order of time; a robot that several cells hear at once has a row of each.
struct FloorTrack {
  std::uint32_t robot = 0;  ///< its number in the file
  std::vector<double> time_s, x_mm, y_mm;

  [[nodiscard]] std::size_t size() const { return time_s.size(); }
};

/// A robot whose rows no robot can have made.
struct FloorFault {
  std::uint32_t robot;
  std::string reason;
};

struct FloorRun {
  std::string name;
  double duration_s = 0;
  std::vector<FloorTrack> tracks;
  std::vector<FloorFault> faults;  ///< left out of tracks
};

/// The floor of the data that we know of: 20 x 40 cells.
struct Floor {
  double width_mm = 1000, height_mm = 2000, cell_mm = 50;
};

/// Whether the directory holds runs of a floor: CSV files, every one with the four columns.
[[nodiscard]] bool has_floor_runs(const std::filesystem::path& directory);

/// All runs of the directory, by name. Robots that are in two places at once or are hardly ever heard are named as faults.
/// Throws UserError where a row does not parse, with file and line.
[[nodiscard]] std::vector<FloorRun> read_floor_runs(const std::filesystem::path& directory, const Floor& = {});

/// One run from its text; `name` stands in errors.
[[nodiscard]] FloorRun parse_floor_run(const std::string& text, const std::string& name, const Floor& = {});

}  // namespace kilotwin::kilogrid

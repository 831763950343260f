#include "clients/identify/kilogrid/floor_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/csv/csv_reader.hpp"

namespace kilotwin::kilogrid {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kHeader = "time_s,robot,x_mm,y_mm";
constexpr std::array<std::string_view, 4> kColumns = {"time_s", "robot", "x_mm", "y_mm"};
constexpr std::uint32_t kHighestRobot = 1'000'000;  // numbers above are refused as errors of the file
/// Largest plausible displacement between cells: two cells and 20 mm/s.
constexpr double kReach_mm = 150, kReach_s = 3;
constexpr double kMostWrongRows = 0.02;  ///< share of steps; fewer count as single erroneous rows
constexpr std::size_t kFewestReports = 60;

bool is_run_file(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.ends_with(".csv") || name.ends_with(".csv.gz");
}

bool has_floor_columns(const CsvReader& csv) {
  return std::all_of(kColumns.begin(), kColumns.end(),
                     [&](std::string_view name) { return csv.find_column(name).has_value(); }) &&
         !csv.find_column("run") && !csv.find_column("heading_rad");
}

/// Why no single robot can have produced the track; nothing if one can.
std::optional<FloorFault> fault_of(const FloorTrack& track) {
  using Kind = FloorFault::Kind;
  if (track.size() < kFewestReports)
    return FloorFault{track.robot, Kind::kFewReports, fmt::format("only {} reports", track.size())};
  std::size_t wrong_rows = 0;
  for (std::size_t i = 1; i < track.size(); ++i) {
    const double way_mm = std::hypot(track.x_mm[i] - track.x_mm[i - 1], track.y_mm[i] - track.y_mm[i - 1]);
    wrong_rows += track.time_s[i] - track.time_s[i - 1] <= kReach_s && way_mm > kReach_mm ? 1u : 0u;
  }
  const double share = static_cast<double>(wrong_rows) / static_cast<double>(track.size());
  if (share > kMostWrongRows)
    return FloorFault{track.robot, Kind::kTwoPlaces,
                      fmt::format("in two places at once in {:.0f} % of its rows", 100 * share)};
  return std::nullopt;
}

/// Removes rows far from both neighbours in time.
void drop_slips(FloorTrack& track) {
  FloorTrack kept{track.robot, {}, {}, {}};
  const auto far = [&](std::size_t a, std::size_t b) {
    return std::abs(track.time_s[b] - track.time_s[a]) <= kReach_s &&
           std::hypot(track.x_mm[b] - track.x_mm[a], track.y_mm[b] - track.y_mm[a]) > kReach_mm;
  };
  for (std::size_t i = 0; i < track.size(); ++i) {
    const bool before = i > 0 && far(i - 1, i), after = i + 1 < track.size() && far(i, i + 1);
    if (before && after) continue;
    kept.time_s.push_back(track.time_s[i]);
    kept.x_mm.push_back(track.x_mm[i]);
    kept.y_mm.push_back(track.y_mm[i]);
  }
  track = std::move(kept);
}

FloorRun read_floor_run(CsvReader csv, const std::string& name, const Floor& floor) {
  std::map<std::uint32_t, FloorTrack> tracks;
  FloorRun run{name, 0, {}, {}};
  csv.require({kColumns[0], kColumns[1], kColumns[2], kColumns[3]}, kHeader);
  const std::size_t time = csv.column("time_s"), id = csv.column("robot"), x = csv.column("x_mm"),
                    y = csv.column("y_mm");
  while (csv.next()) {
    const double time_s = csv.number(time), x_mm = csv.number(x), y_mm = csv.number(y);
    const std::uint32_t robot = csv.whole(id);
    const auto check = [&](std::size_t column, bool right, const std::string& expected) {
      if (!right)
        csv.complain(column, fmt::format("{} is {}; {}", csv.columns()[column], csv.text(column), expected));
    };
    check(time, time_s >= 0, "times are at least 0");
    check(id, robot <= kHighestRobot, fmt::format("robots are 0..{}", kHighestRobot));
    check(x, x_mm > 0 && x_mm < floor.width_mm, fmt::format("on this floor x is within 0..{} mm", floor.width_mm));
    check(y, y_mm > 0 && y_mm < floor.height_mm,
          fmt::format("on this floor y is within 0..{} mm", floor.height_mm));
    FloorTrack& track = tracks[robot];
    check(time, track.time_s.empty() || track.time_s.back() <= time_s,
          "the previous row is later; sort the rows by time");
    track.time_s.push_back(time_s);
    track.x_mm.push_back(x_mm);
    track.y_mm.push_back(y_mm);
    run.duration_s = std::max(run.duration_s, time_s);
  }
  for (auto& [robot, track] : tracks) {
    track.robot = robot;
    if (std::optional<FloorFault> fault = fault_of(track)) {
      run.faults.push_back(std::move(*fault));
      continue;
    }
    drop_slips(track);
    run.tracks.push_back(std::move(track));
  }
  return run;
}

}  // namespace

FloorRun parse_floor_run(const std::string& text, const std::string& name, const Floor& floor) {
  return read_floor_run(CsvReader(name, text), name, floor);
}

bool has_floor_runs(const fs::path& directory) {
  bool any = false;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    if (!is_run_file(entry.path())) continue;
    if (!has_floor_columns(CsvReader(entry.path()))) return false;
    any = true;
  }
  return any;
}

std::vector<FloorRun> read_floor_runs(const fs::path& directory, const Floor& floor) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    if (is_run_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<FloorRun> runs;
  for (const fs::path& file : files) {
    runs.push_back(read_floor_run(CsvReader(file), file.string(), floor));
    const std::string name = file.filename().string();
    runs.back().name = name.substr(0, name.find(".csv"));
  }
  return runs;
}

}  // namespace kilotwin::kilogrid

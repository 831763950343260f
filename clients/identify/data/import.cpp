#include "clients/identify/data/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/data/table_import.hpp"
#include "core/base/error.hpp"
#include "core/csv/csv_reader.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

constexpr std::array<std::string_view, 5> kRecordingColumns = {"time_s", "robot", "x_mm", "y_mm", "heading_rad"};
// Columns of an ARK log that are read, and the fewest columns that a log has.
constexpr std::size_t kTime = 0, kId = 1, kX = 3, kY = 4, kArkColumns = 6;

bool is_ark_log(const fs::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".tsv" || ending == ".txt" || ending == ".log";
}

template <class Number> bool parse(std::string_view cell, Number& value) {
  while (cell.starts_with(' ')) cell.remove_prefix(1);
  while (cell.ends_with(' ')) cell.remove_suffix(1);
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size() && !cell.empty();
}

/// A finite number. False if the text is none.
bool parse_finite(std::string_view cell, double& value) {
  return parse(cell, value) && std::isfinite(value) && std::abs(value) < 1e9;
}

bool is_table(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.ends_with(".csv") || name.ends_with(".csv.gz");
}

/// ARK logs have no header, and their last row may be cut off.
constexpr CsvLayout kArkLayout{'\t', false, false};

/// Whether the first row is a row of an ARK log, or the names of its columns.
bool looks_like_ark_log(const fs::path& file) {
  try {
    CsvReader csv(file, kArkLayout);
    double time_s = 0;
    return csv.next() && csv.cells() >= kArkColumns &&
           (parse_finite(csv.text(kTime), time_s) || csv.text(kTime) == "t");
  } catch (const UserError&) {
    return false;  // text of another kind
  }
}

bool looks_like_recording(const fs::path& file) {
  try {
    const CsvReader csv(file);
    return std::all_of(kRecordingColumns.begin(), kRecordingColumns.end(),
                       [&](std::string_view name) { return csv.find_column(name).has_value(); }) &&
           !csv.find_column("run");
  } catch (const UserError&) {
    return false;
  }
}

}  // namespace

std::vector<fs::path> importable(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code error;
  if (!fs::is_directory(directory, error) || has_trajectories(directory)) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const fs::path& file = entry.path();
    if (!entry.is_regular_file(error) || run_of_file(file) == "commands") continue;
    if ((is_ark_log(file) && looks_like_ark_log(file)) ||
        (is_table(file) && (looks_like_recording(file) || is_track_table(file))))
      files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  return files;
}

void add_ark_log(const fs::path& file, SetBuilder& builder) {
  CsvReader csv(file, kArkLayout);
  const std::string run = run_of_file(file);
  bool has_rows = false;
  while (csv.next()) {
    double time_s = 0, x = 0, y = 0;
    std::uint32_t id = 0;
    // The line of column names above all rows.
    if (!has_rows && csv.cells() >= kArkColumns && !parse_finite(csv.text(kTime), time_s) &&
        !parse_finite(csv.text(kX), x))
      continue;
    if (csv.cells() < kArkColumns) {
      if (csv.cut_off()) break;
      csv.complain(0, fmt::format("{} cells, separated by tabs; an ARK log has t, id, colour, x, y, orientation",
                                  csv.cells()));
    }
    const auto complain = [&](std::size_t column, const char* what, const char* right) {
      csv.complain(column, fmt::format("{} is \"{}\"; give {}", what, csv.text(column), right));
    };
    if (!parse_finite(csv.text(kTime), time_s)) complain(kTime, "time", "seconds");
    if (!parse(csv.text(kId), id)) complain(kId, "id", "a whole number");
    if (!parse_finite(csv.text(kX), x)) complain(kX, "x", "pixels");
    if (!parse_finite(csv.text(kY), y)) complain(kY, "y", "pixels");
    builder.add(run, id, {time_s, x - 0.5 * kArkMosaic_mm, 0.5 * kArkMosaic_mm - y, std::nan("")});
    has_rows = true;
  }
  if (!has_rows)
    throw UserError(fmt::format(
        "{}: has no rows; an ARK log has t, id, colour, x, y, orientation, separated by tabs", file.string()));
}

void add_recording(const fs::path& file, SetBuilder& builder) {
  CsvReader csv(file);
  const std::size_t time = csv.column("time_s"), robot = csv.column("robot"), x = csv.column("x_mm"),
                    y = csv.column("y_mm"), heading = csv.column("heading_rad");
  const std::string run = run_of_file(file);
  bool has_rows = false;
  while (csv.next()) {
    builder.add(run, csv.whole(robot), {csv.number(time), csv.number(x), csv.number(y), csv.number(heading)});
    has_rows = true;
  }
  if (!has_rows) throw UserError(fmt::format("{}: has no rows", file.string()));
}

namespace {

enum class Kind { kArkLog, kRecording, kTrackTable };

Kind kind_of(const fs::path& file) {
  if (is_ark_log(file)) return Kind::kArkLog;
  return is_track_table(file) ? Kind::kTrackTable : Kind::kRecording;
}

void add_file(const fs::path& file, Kind kind, SetBuilder& builder) {
  switch (kind) {
    case Kind::kArkLog: return add_ark_log(file, builder);
    case Kind::kTrackTable: return add_track_table(file, builder);
    case Kind::kRecording: return add_recording(file, builder);
  }
}

MeasuredSet imported(const fs::path& directory, const std::vector<fs::path>& files) {
  const Kind kind = kind_of(files.front());
  std::map<std::string, fs::path> runs;
  SetBuilder builder;
  for (const fs::path& file : files) {
    if (kind_of(file) != kind) {
      throw UserError(fmt::format(
          "{}: is of another kind than {}; give ARK logs, recordings or tables of kilotwin track, not both",
          file.string(), files.front().filename().string()));
    }
    const auto [known, fresh] = runs.emplace(run_of_file(file), file);
    if (!fresh)
      throw UserError(fmt::format("{}: names the same run as {}; rename one", file.string(),
                                  known->second.filename().string()));
    add_file(file, kind, builder);
  }
  builder.add_commands(directory);
  return builder.finish();
}

/// Names of the runs whose robots are known by their tracks only.
std::set<std::string> unnumbered_runs(const std::vector<fs::path>& files) {
  std::set<std::string> runs;
  for (const fs::path& file : files)
    if (kind_of(file) == Kind::kTrackTable && !CsvReader(file).find_column("robot")) runs.insert(run_of_file(file));
  return runs;
}

/// The number above all numbers of robots in other runs than these; 0 if there are none.
std::uint32_t first_free_number(const MeasuredSet& set, const std::set<std::string>& unnumbered) {
  std::uint32_t next = 0;
  for (const Run& run : set.runs)
    for (const Track& track : run.tracks)
      if (!unnumbered.contains(run.name)) next = std::max(next, track.robot + 1);
  return next;
}

/// Gives each track of these runs a number that no other track has, from `next` on or above all known numbers.
void number_tracks(MeasuredSet& set, const std::set<std::string>& runs, std::uint32_t next) {
  next = std::max(next, first_free_number(set, runs));
  for (Run& run : set.runs) {
    if (!runs.contains(run.name)) continue;
    for (Track& track : run.tracks) track.robot = next++;
  }
}

}  // namespace

std::uint32_t first_number_beside(const fs::path& directory, const fs::path& other) {
  if (unnumbered_runs(importable(directory)).empty()) return 0;
  const std::vector<fs::path> files = importable(other);
  const MeasuredSet set = files.empty() ? load_measured_set(other) : imported(other, files);
  return first_free_number(set, unnumbered_runs(files));
}

MeasuredSet load_or_import(const fs::path& directory, std::uint32_t first_number) {
  const std::vector<fs::path> files = importable(directory);
  if (files.empty()) return load_measured_set(directory);
  MeasuredSet set = imported(directory, files);
  const std::set<std::string> unnumbered = unnumbered_runs(files);
  if (!unnumbered.empty()) number_tracks(set, unnumbered, first_number);
  return set;
}

}  // namespace kilotwin::identify

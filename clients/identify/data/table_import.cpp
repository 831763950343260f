#include "clients/identify/data/table_import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/utf8.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kColumnsExample = "time=t,robot=ID,x=px,y=py,heading=theta";

/// Whether the ending is that of a table.
bool is_table(const fs::path& file) {
  const std::string ending = (file.extension() == ".gz" ? file.stem() : file).extension().string();
  return ending == ".csv" || ending == ".tsv";
}

/// The tables of a directory but its commands, sorted.
std::vector<fs::path> tables_of(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const fs::path& file = entry.path();
    if (is_table(file) && !file.filename().string().starts_with("commands.csv")) files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The column of that name. Throws UserError that says how to name another one.
std::size_t named(const CsvReader& csv, const fs::path& file, const char* key, const std::string& name) {
  if (const auto column = csv.find_column(name)) return *column;
  std::string there;
  for (const std::string& column : csv.columns()) there += (there.empty() ? "" : ", ") + column;
  throw UserError(fmt::format("{}: has no column \"{}\", only {}; name it: --columns {}=NAME", file.string(), name,
                              there, key));
}

void add_table(const fs::path& file, const TableFormat& format, SetBuilder& builder) {
  CsvReader csv(file);
  const std::size_t time = named(csv, file, "time", format.time), robot = named(csv, file, "robot", format.robot),
                    x = named(csv, file, "x", format.x), y = named(csv, file, "y", format.y);
  std::optional<std::size_t> heading, run;
  if (!format.heading.empty()) heading = named(csv, file, "heading", format.heading);
  if (!format.run.empty()) run = named(csv, file, "run", format.run);
  const double up = format.image ? -1 : 1, angle = up * (format.degrees ? M_PI / 180 : 1);
  const std::string of_file = run_of_file(file);
  while (csv.next()) {
    const double x_units = csv.number_or_nan(x), y_units = csv.number_or_nan(y);
    if (std::isnan(x_units) || std::isnan(y_units)) continue;  // the tracker lost the robot
    if (run && !is_utf8(csv.text(*run))) csv.complain(*run, "run is not UTF-8; save the table as UTF-8");
    builder.add(run ? csv.text(*run) : of_file, csv.whole(robot),
                {format.unit_s * csv.number(time), format.unit_mm * x_units, up * format.unit_mm * y_units,
                 heading ? angle * csv.number_or_nan(*heading) : std::numeric_limits<double>::quiet_NaN()});
  }
}

/// A row of a table of `kilotwin track`: one robot in one frame.
struct TrackedRow {
  std::uint32_t robot;
  double time_s, x, y, radius_px;
};

std::vector<TrackedRow> tracked_rows(const fs::path& file, bool& calibrated) {
  CsvReader csv(file);
  const std::size_t time = csv.column("time_s"), track = csv.column("track"), radius = csv.column("radius_px");
  const auto number = csv.find_column("robot"), x_mm = csv.find_column("x_mm"), y_mm = csv.find_column("y_mm");
  calibrated = x_mm && y_mm;
  const std::size_t x = calibrated ? *x_mm : csv.column("x_px"), y = calibrated ? *y_mm : csv.column("y_px");
  std::vector<TrackedRow> rows;
  while (csv.next()) {
    // A robot whose number is not known yet has -1: it may be any.
    if (number && csv.text(*number) == "-1") continue;
    rows.push_back({csv.whole(number ? *number : track), csv.number(time), csv.number_or_nan(x),
                    csv.number_or_nan(y), csv.number(radius)});
  }
  std::erase_if(rows, [](const TrackedRow& r) { return std::isnan(r.x) || std::isnan(r.y); });
  return rows;
}

}  // namespace

void set_columns(TableFormat& format, const std::string& text) {
  const std::array<std::pair<std::string_view, std::string*>, 6> keys = {{{"time", &format.time},
                                                                          {"robot", &format.robot},
                                                                          {"x", &format.x},
                                                                          {"y", &format.y},
                                                                          {"heading", &format.heading},
                                                                          {"run", &format.run}}};
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size()), equals = text.find('=', at);
    const std::string part = text.substr(at, end - at);
    const auto key = std::find_if(keys.begin(), keys.end(), [&](const auto& k) {
      return equals < end && k.first == text.substr(at, equals - at);
    });
    if (key == keys.end() || equals + 1 >= end)
      throw UserError(
          fmt::format("--columns: \"{}\" names no column; give time, robot, x, y, heading or run with "
                      "the table's name: {}",
                      part, kColumnsExample));
    *key->second = text.substr(equals + 1, end - equals - 1);
    at = end + 1;
  }
}

MeasuredSet read_tables(const fs::path& directory, const TableFormat& format) {
  const std::vector<fs::path> files = tables_of(directory);
  if (files.empty())
    throw UserError(fmt::format("{}: holds no table (*.csv, *.tsv); give a directory with the tracker's tables",
                                directory.string()));
  SetBuilder builder;
  std::set<std::string> runs;
  for (const fs::path& file : files) {
    if (format.run.empty() && !runs.insert(run_of_file(file)).second)
      throw UserError(fmt::format("{}: names the same run as another table; rename one", file.string()));
    add_table(file, format, builder);
  }
  builder.add_commands(directory);
  MeasuredSet set = builder.finish();
  if (set.samples() == 0) throw UserError(fmt::format("{}: the tables have no rows", directory.string()));
  return set;
}

bool has_headings(const fs::path& directory) {
  const std::vector<fs::path> files = tables_of(directory);
  return std::any_of(files.begin(), files.end(),
                     [](const fs::path& file) { return CsvReader(file).find_column("heading_rad").has_value(); });
}

bool is_track_table(const fs::path& file) {
  try {
    const CsvReader csv(file);
    const auto has = [&](const char* name) { return csv.find_column(name).has_value(); };
    return has("frame") && has("track") && has("x_px") && has("y_px") && has("radius_px") && has("heading_rad");
  } catch (const UserError&) {
    return false;
  }
}

void add_track_table(const fs::path& file, SetBuilder& builder) {
  bool calibrated = false;
  const std::vector<TrackedRow> rows = tracked_rows(file, calibrated);
  if (rows.empty()) throw UserError(fmt::format("{}: shows no robot", file.string()));
  double unit_mm = 1, up = 1, x_middle = 0, y_middle = 0;
  if (!calibrated) {
    std::vector<double> radii;
    double low_x = rows.front().x, high_x = low_x, low_y = rows.front().y, high_y = low_y;
    for (const TrackedRow& row : rows) {
      radii.push_back(row.radius_px);
      low_x = std::min(low_x, row.x), high_x = std::max(high_x, row.x);
      low_y = std::min(low_y, row.y), high_y = std::max(high_y, row.y);
    }
    unit_mm = kRobotRadius_mm / stats::upper_median(radii);
    x_middle = (low_x + high_x) / 2;
    y_middle = (low_y + high_y) / 2;
    up = -1;  // y of a picture points down
  }
  const std::string run = run_of_file(file);
  for (const TrackedRow& row : rows)
    builder.add(run, row.robot,
                {row.time_s, unit_mm * (row.x - x_middle), up * unit_mm * (row.y - y_middle),
                 std::numeric_limits<double>::quiet_NaN()});
}

}  // namespace kilotwin::identify

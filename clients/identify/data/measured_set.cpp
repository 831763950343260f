#include "clients/identify/data/measured_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "clients/identify/data/set_builder.hpp"
#include "core/base/error.hpp"
#include "core/base/utf8.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kTrajectoryColumns = "run,robot,time_s,x_mm,y_mm[,heading_rad]";
constexpr const char* kNames[] = {"stop", "straight", "left", "right"};

void require_trajectory_columns(const CsvReader& csv) {
  csv.require({"run", "robot", "time_s", "x_mm", "y_mm"}, kTrajectoryColumns);
}

/// Why a directory without trajectories.csv cannot be read: by the first table in it, where it holds one.
[[noreturn]] void refuse(const fs::path& directory) {
  std::error_code error;
  if (fs::is_regular_file(directory, error)) {
    throw UserError(
        fmt::format("{}: is a file; give the directory that holds trajectories.csv", directory.string()));
  }
  std::vector<fs::path> tables;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("commands.") && (name.ends_with(".csv") || name.ends_with(".csv.gz")))
      tables.push_back(entry.path());
  }
  std::sort(tables.begin(), tables.end());
  for (const fs::path& table : tables) require_trajectory_columns(CsvReader(table));
  throw UserError(fmt::format("{}: holds no trajectories.csv or trajectories.csv.gz with {}{}", directory.string(),
                              kTrajectoryColumns,
                              tables.empty() ? "" : "; rename " + tables.front().filename().string()));
}

void read_trajectories(const fs::path& file, SetBuilder& builder) {
  CsvReader csv(file);
  require_trajectory_columns(csv);
  const std::size_t run = csv.column("run"), robot = csv.column("robot"), time = csv.column("time_s"),
                    x = csv.column("x_mm"), y = csv.column("y_mm");
  const auto heading = csv.find_column("heading_rad");
  while (csv.next()) {
    const Sample sample{csv.number(time), csv.number(x), csv.number(y),
                        heading ? csv.number_or_nan(*heading) : std::nan("")};
    if (!is_utf8(csv.text(run)))
      csv.complain(run, "run is not UTF-8; save the table as UTF-8");  // it enters the result
    builder.add(csv.text(run), csv.whole(robot), sample);
  }
}

}  // namespace

const char* name_of(Motion motion) { return kNames[static_cast<std::size_t>(motion)]; }

std::size_t MeasuredSet::samples() const {
  std::size_t count = 0;
  for (const Run& run : runs)
    for (const Track& track : run.tracks) count += track.samples.size();
  return count;
}

std::size_t MeasuredSet::tracks() const {
  std::size_t count = 0;
  for (const Run& run : runs) count += run.tracks.size();
  return count;
}

std::vector<std::uint32_t> MeasuredSet::robots() const {
  std::vector<std::uint32_t> robots;
  for (const Run& run : runs)
    for (const Track& track : run.tracks) robots.push_back(track.robot);
  std::sort(robots.begin(), robots.end());
  robots.erase(std::unique(robots.begin(), robots.end()), robots.end());
  return robots;
}

bool has_trajectories(const fs::path& directory) { return find_table(directory, "trajectories").has_value(); }

MeasuredSet load_measured_set(const fs::path& directory) {
  const auto trajectories = find_table(directory, "trajectories");
  if (!trajectories) refuse(directory);
  SetBuilder builder;
  read_trajectories(*trajectories, builder);
  builder.add_commands(directory);
  MeasuredSet set = builder.finish();
  if (set.samples() == 0)
    throw UserError(fmt::format("{}: has no rows; there is nothing to identify", trajectories->string()));
  return set;
}

void save_measured_set(const MeasuredSet& set, const fs::path& directory) {
  std::error_code ignored;
  fs::create_directories(directory, ignored);
  CsvWriter trajectories(directory / "trajectories.csv", set.has_headings ? "run,robot,time_s,x_mm,y_mm,heading_rad"
                                                                          : "run,robot,time_s,x_mm,y_mm");
  std::string commands;
  for (const Run& run : set.runs) {
    const std::string name = csv_cell(run.name);
    for (const Track& track : run.tracks) {
      for (const Sample& s : track.samples) {
        std::string& rows = trajectories.rows();
        fmt::format_to(std::back_inserter(rows), "{},{},{:.4f},{:.4f},{:.4f}", name, track.robot, s.time_s, s.x_mm,
                       s.y_mm);
        if (set.has_headings) rows += std::isnan(s.heading_rad) ? "," : fmt::format(",{:.5f}", s.heading_rad);
        rows += '\n';
        trajectories.flush_if_long();
      }
      for (const CommandChange& c : track.commands) {
        if (c.time_s > -1e299 || c.motion != Motion::kStop)
          commands +=
              fmt::format("{},{},{:.4f},{}\n", name, track.robot, std::max(c.time_s, -1e6), name_of(c.motion));
      }
    }
  }
  trajectories.close();
  if (!set.has_commands) return;
  CsvWriter writer(directory / "commands.csv", "run,robot,time_s,motion");
  writer.rows() += commands;
  writer.close();
}

}  // namespace kilotwin::identify

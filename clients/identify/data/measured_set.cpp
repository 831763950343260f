#include "clients/identify/data/measured_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "core/base/error.hpp"
#include "core/base/utf8.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kTrajectoryColumns = "run,robot,time_s,x_mm,y_mm[,heading_rad]";
constexpr const char* kNames[] = {"stop", "straight", "left", "right"};

std::optional<fs::path> find_csv(const fs::path& directory, const char* stem) {
  for (const char* suffix : {".csv", ".csv.gz"}) {
    const fs::path file = directory / (std::string(stem) + suffix);
    std::error_code ignored;
    if (fs::exists(file, ignored)) return file;
  }
  return std::nullopt;
}

/// The tracks of a set while its files are read.
class Builder {
 public:
  explicit Builder(MeasuredSet& set) : set_(set) {}

  /// Null if the track is absent and `make` is false.
  Track* track(std::string_view run, std::uint32_t robot, bool make) {
    if (last_ != nullptr && last_->robot == robot && last_run_ == run) return last_;
    auto known = runs_.find(run);
    if (known == runs_.end()) {
      if (!make) return nullptr;
      known = runs_.emplace(std::string(run), runs_.size()).first;
      set_.runs.push_back({std::string(run), {}});
      tracks_.emplace_back();
    }
    auto& tracks = tracks_[known->second];
    if (!make && !tracks.contains(robot)) return nullptr;
    last_ = &tracks[robot];
    last_->robot = robot;
    last_run_ = run;
    return last_;
  }
  void finish() {
    for (std::size_t r = 0; r < tracks_.size(); ++r)
      for (auto& [robot, track] : tracks_[r]) set_.runs[r].tracks.push_back(std::move(track));
  }
  template <class Function> void each(Function&& function) {
    for (auto& tracks : tracks_)
      for (auto& [robot, track] : tracks) function(track);
  }

 private:
  MeasuredSet& set_;
  std::map<std::string, std::size_t, std::less<>> runs_;
  std::vector<std::map<std::uint32_t, Track>> tracks_;
  Track* last_ = nullptr;
  std::string last_run_;
};

Motion motion_of(const CsvReader& csv, std::size_t column) {
  for (std::uint8_t m = 0; m < 4; ++m)
    if (csv.text(column) == kNames[m]) return static_cast<Motion>(m);
  csv.complain(column, fmt::format("motion is \"{}\"; give stop, straight, left or right", csv.text(column)));
}

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

void read_trajectories(const fs::path& file, MeasuredSet& set, Builder& builder) {
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
    builder.track(csv.text(run), csv.whole(robot), true)->samples.push_back(sample);
    set.has_headings = set.has_headings || !std::isnan(sample.heading_rad);
  }
  builder.each([](Track& track) {
    std::stable_sort(track.samples.begin(), track.samples.end(),
                     [](const Sample& a, const Sample& b) { return a.time_s < b.time_s; });
  });
}

void read_commands(const fs::path& file, Builder& builder) {
  CsvReader csv(file);
  csv.require({"run", "robot", "time_s", "motion"}, "run,robot,time_s,motion");
  const std::size_t run = csv.column("run"), robot = csv.column("robot"), time = csv.column("time_s"),
                    motion = csv.column("motion");
  while (csv.next()) {
    const CommandChange change{csv.number(time), motion_of(csv, motion)};
    // Commands of a robot without positions are ignored.
    if (Track* const track = builder.track(csv.text(run), csv.whole(robot), false))
      track->commands.push_back(change);
  }
}

/// Sorts the times, removes changes that repeat the command, and adds a command before the first sample.
void tidy(Track& track, Motion at_first) {
  auto& commands = track.commands;
  std::stable_sort(commands.begin(), commands.end(),
                   [](const CommandChange& a, const CommandChange& b) { return a.time_s < b.time_s; });
  std::vector<CommandChange> kept{{-1e300, at_first}};
  for (const CommandChange& change : commands) {
    if (change.time_s == kept.back().time_s) kept.back() = change;
    if (change.motion != kept.back().motion) kept.push_back(change);
  }
  commands = std::move(kept);
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

bool has_trajectories(const fs::path& directory) { return find_csv(directory, "trajectories").has_value(); }

MeasuredSet load_measured_set(const fs::path& directory) {
  const auto trajectories = find_csv(directory, "trajectories");
  if (!trajectories) refuse(directory);
  MeasuredSet set;
  Builder builder(set);
  read_trajectories(*trajectories, set, builder);
  if (const auto commands = find_csv(directory, "commands")) {
    set.has_commands = true;
    read_commands(*commands, builder);
  }
  builder.each([&](Track& track) { tidy(track, set.has_commands ? Motion::kStop : Motion::kStraight); });
  builder.finish();
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

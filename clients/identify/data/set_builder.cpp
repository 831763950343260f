#include "clients/identify/data/set_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/utf8.hpp"
#include "core/csv/csv_reader.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

Motion motion_of(const CsvReader& csv, std::size_t column) {
  for (const Motion motion : {Motion::kStop, Motion::kStraight, Motion::kLeft, Motion::kRight})
    if (csv.text(column) == name_of(motion)) return motion;
  csv.complain(column, fmt::format("motion is \"{}\"; give stop, straight, left or right", csv.text(column)));
}

/// Sorts the times, removes changes that repeat the command, and adds a command before the first sample.
void tidy(Track& track, Motion at_first) {
  std::stable_sort(track.samples.begin(), track.samples.end(),
                   [](const Sample& a, const Sample& b) { return a.time_s < b.time_s; });
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

Track* SetBuilder::find(std::string_view run, std::uint32_t robot) {
  if (last_ != nullptr && last_->robot == robot && last_run_ == run) return last_;
  const auto known = runs_.find(run);
  if (known == runs_.end()) return nullptr;
  const auto track = tracks_[known->second].find(robot);
  if (track == tracks_[known->second].end()) return nullptr;
  last_ = &track->second;
  last_run_ = run;
  return last_;
}

void SetBuilder::add(std::string_view run, std::uint32_t robot, const Sample& sample) {
  set_.has_headings = set_.has_headings || !std::isnan(sample.heading_rad);
  if (Track* const track = find(run, robot)) {
    track->samples.push_back(sample);
    return;
  }
  const auto [known, fresh] = runs_.emplace(std::string(run), runs_.size());
  if (fresh) {
    set_.runs.push_back({known->first, {}});
    tracks_.emplace_back();
  }
  Track& track = tracks_[known->second][robot];
  track.robot = robot;
  track.samples.push_back(sample);
}

void SetBuilder::add_commands(const fs::path& directory) {
  const auto file = find_table(directory, "commands");
  if (!file) return;
  set_.has_commands = true;
  CsvReader csv(*file);
  csv.require({"run", "robot", "time_s", "motion"}, "run,robot,time_s,motion");
  const std::size_t run = csv.column("run"), robot = csv.column("robot"), time = csv.column("time_s"),
                    motion = csv.column("motion");
  while (csv.next()) {
    const CommandChange change{csv.number(time), motion_of(csv, motion)};
    if (Track* const track = find(csv.text(run), csv.whole(robot))) track->commands.push_back(change);
  }
}

MeasuredSet SetBuilder::finish() {
  const Motion at_first = set_.has_commands ? Motion::kStop : Motion::kStraight;
  for (std::size_t r = 0; r < tracks_.size(); ++r) {
    for (auto& [robot, track] : tracks_[r]) {
      tidy(track, at_first);
      set_.runs[r].tracks.push_back(std::move(track));
    }
  }
  return std::move(set_);
}

std::optional<fs::path> find_table(const fs::path& directory, const char* stem) {
  for (const char* ending : {".csv", ".csv.gz"}) {
    const fs::path file = directory / (std::string(stem) + ending);
    std::error_code ignored;
    if (fs::exists(file, ignored)) return file;
  }
  return std::nullopt;
}

std::string run_of_file(const fs::path& file) {
  std::string name = (file.extension() == ".gz" ? file.stem() : file).stem().string();
  if (!is_utf8(name))
    throw UserError(
        fmt::format("{}: the name is not UTF-8; rename the file: runs are named after it", file.string()));
  return name;
}

}  // namespace kilotwin::identify

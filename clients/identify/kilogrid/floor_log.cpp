#include "clients/identify/kilogrid/floor_log.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

#include "core/base/error.hpp"

namespace kilotwin::kilogrid {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view kHeader = "time_s,robot,x_mm,y_mm";
/// No Kilobot gets that far in that time, whatever cell hears it: two cells and 20 mm/s.
constexpr double kReach_mm = 150, kReach_s = 3;
constexpr double kMostJumps = 0.02;  ///< share of steps; the rest are slips of single rows
constexpr std::size_t kFewestReports = 60;

bool is_run_file(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.ends_with(".csv") || name.ends_with(".csv.gz");
}

/// The text of a file, compressed or not.
std::string text_of(const fs::path& file, std::size_t most = SIZE_MAX) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  if (!in) throw UserError(fmt::format("{}: it cannot be read", file.string()));
  std::string text;
  char block[1 << 16];
  while (text.size() < most) {
    const int got = gzread(in.get(), block, sizeof block);
    if (got < 0) throw UserError(fmt::format("{}: it is not a whole compressed file", file.string()));
    if (got == 0) break;
    text.append(block, static_cast<std::size_t>(got));
  }
  return text;
}

/// Takes one number and what follows it.
double take_number(const char*& at, const char* end, char after, const std::string& name, std::size_t line) {
  double value = 0;
  const auto [rest, error] = std::from_chars(at, end, value);
  const bool last = after == '\n';
  if (error != std::errc{} || !std::isfinite(value) || (last ? rest != end : rest == end || *rest != after)) {
    throw UserError(
        fmt::format("{}:{}:1: it is not a row of the floor; each is time_s,robot,x_mm,y_mm", name, line));
  }
  at = last ? rest : rest + 1;
  return value;
}

/// Why no single robot can have made the track; empty: one can.
std::string fault_of(const FloorTrack& track) {
  if (track.size() < kFewestReports) return fmt::format("heard {} times only", track.size());
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < track.size(); ++i) {
    const double way_mm = std::hypot(track.x_mm[i] - track.x_mm[i - 1], track.y_mm[i] - track.y_mm[i - 1]);
    jumps += track.time_s[i] - track.time_s[i - 1] <= kReach_s && way_mm > kReach_mm ? 1u : 0u;
  }
  const double share = static_cast<double>(jumps) / static_cast<double>(track.size());
  return share > kMostJumps ? fmt::format("in two places at once in {:.0f} % of its rows", 100 * share)
                            : std::string();
}

/// Rows that lie far from both their neighbours in time are not of this robot.
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

}  // namespace

FloorRun parse_floor_run(const std::string& text, const std::string& name, const Floor& floor) {
  std::map<std::uint32_t, FloorTrack> tracks;
  FloorRun run{name, 0, {}, {}};
  std::size_t begin = 0, line = 0;
  while (begin < text.size()) {
    std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t next = end + 1;
    if (end > begin && text[end - 1] == '\r') --end;
    const char *at = text.data() + begin, *const stop = text.data() + end;
    begin = next;
    ++line;
    if (at == stop) continue;
    if (line == 1) {
      if (std::string_view(at, stop) != kHeader)
        throw UserError(
            fmt::format("{}:1:1: it does not begin with the columns of a floor; write {}", name, kHeader));
      continue;
    }
    const double time_s = take_number(at, stop, ',', name, line), robot = take_number(at, stop, ',', name, line),
                 x_mm = take_number(at, stop, ',', name, line), y_mm = take_number(at, stop, '\n', name, line);
    const bool inside = x_mm > 0 && x_mm < floor.width_mm && y_mm > 0 && y_mm < floor.height_mm;
    if (time_s < 0 || robot < 0 || robot > 1e6 || robot != std::floor(robot) || !inside) {
      throw UserError(
          fmt::format("{}:{}:1: no robot can be there; times are at least 0, x within {} mm, y within {} mm", name,
                      line, floor.width_mm, floor.height_mm));
    }
    FloorTrack& track = tracks[static_cast<std::uint32_t>(robot)];
    if (!track.time_s.empty() && track.time_s.back() > time_s)
      throw UserError(fmt::format("{}:{}:1: time goes back; sort the rows by time", name, line));
    track.time_s.push_back(time_s);
    track.x_mm.push_back(x_mm);
    track.y_mm.push_back(y_mm);
    run.duration_s = std::max(run.duration_s, time_s);
  }
  for (auto& [robot, track] : tracks) {
    track.robot = robot;
    if (std::string fault = fault_of(track); !fault.empty()) {
      run.faults.push_back({robot, std::move(fault)});
      continue;
    }
    drop_slips(track);
    run.tracks.push_back(std::move(track));
  }
  return run;
}

bool has_floor_runs(const fs::path& directory) {
  bool any = false;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    if (!is_run_file(entry.path())) continue;
    if (!text_of(entry.path(), kHeader.size() + 1).starts_with(kHeader)) return false;
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
    runs.push_back(parse_floor_run(text_of(file), file.string(), floor));
    const std::string name = file.filename().string();
    runs.back().name = name.substr(0, name.find(".csv"));
  }
  return runs;
}

}  // namespace kilotwin::kilogrid

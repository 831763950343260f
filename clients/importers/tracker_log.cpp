// Logs of trackers. docs/how-to/from-tracker-logs.md lists what becomes of their columns.
#include "clients/importers/tracker_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "clients/doors/logs/log_reader.hpp"
#include "clients/doors/placement.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"

namespace kilotwin::importers {
namespace {

using doors::LogRobot;
using doors::LogRow;

/// Pixels of ARK's stitched picture, and of the camera of LARS.
constexpr double kArkSide_px = 2000, kLarsWidth_px = 1920, kLarsHeight_px = 1200;

/// Rows of ARK begin with a number and a tab; a log of LARS begins with a header in words.
proto::LogDoor::Format format_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  while (std::getline(in, line) && line.find_first_not_of(" \t\r") == std::string::npos) {}
  const std::size_t tab = line.find('\t');
  const bool row = tab != std::string::npos && tab > 0 && line.find_first_not_of("0123456789.+-eE") == tab;
  return row ? proto::LogDoor::ARK : proto::LogDoor::LARS;
}

struct First {
  double x_mm = 0, y_mm = 0, heading_rad = 0, time_s = 0;
};

class LogImport {
 public:
  LogImport(const std::filesystem::path& file, const LogOptions& options)
      : file_(file), lars_(options.format.value_or(format_of(file)) == proto::LogDoor::LARS) {
    if (lars_ && !options.unit_mm)
      throw UserError(
          fmt::format("{}: a log of LARS is in pixels of its camera; give --unit-mm, millimetres per pixel",
                      one_line(file.string())));
    const double unit_mm = options.unit_mm.value_or(1);
    door_.set_name(lars_ ? "lars-log" : "ark-log");
    proto::Placement& placement = *door_.mutable_placement();
    width_mm_ = unit_mm * (lars_ ? kLarsWidth_px : kArkSide_px);
    height_mm_ = unit_mm * (lars_ ? kLarsHeight_px : kArkSide_px);
    if (std::min(width_mm_, height_mm_) < 2 * kFromWall_mm)
      throw UserError(fmt::format(
          "{}: with --unit-mm {:g} the picture is {:g} by {:g} mm, smaller than a robot; give millimetres "
          "per pixel",
          one_line(file.string()), unit_mm, width_mm_, height_mm_));
    placement.set_unit_mm(unit_mm);
    placement.set_x_mm(-width_mm_ / 2);
    placement.set_y_mm(height_mm_ / 2);
    door_.mutable_log()->set_format(lars_ ? proto::LogDoor::LARS : proto::LogDoor::ARK);
  }

  ImportedLog result() {
    const doors::Placement placement(door_);
    doors::LogReader reader(file_, door_.log());
    const std::string run = file_.stem().string();
    ImportedLog out;
    out.tracks = "run,robot,time_s,x_mm,y_mm\n";
    while (const auto row = reader.next()) take(*row, placement, run, out.tracks);
    if (first_.empty()) throw UserError(fmt::format("{}: holds no position of a robot", one_line(file_.string())));
    out.imported = std::move(imported_);
    write_experiment(out.imported, run);
    add_notes(out.imported);
    return out;
  }

 private:
  void take(const LogRow& row, const doors::Placement& placement, const std::string& run, std::string& tracks) {
    if (rows_++ == 0) begin_s_ = row.time_s;
    last_s_ = row.time_s - begin_s_;
    for (const LogRobot& robot : row.robots) {
      doors::TrackedRobot placed;
      if (placement.place_point(robot.x, robot.y, placed) != doors::Fault::kNone) {
        ++lost_;
        continue;
      }
      has_led_ = has_led_ || robot.led != doors::kLedUnknown;
      has_velocity_ = has_velocity_ || robot.vx.has_value();
      if (std::abs(placed.x_mm) > width_mm_ / 2 || std::abs(placed.y_mm) > height_mm_ / 2) ++outside_;
      if (robot.heading_rad) placement.place_heading(*robot.heading_rad, placed);
      first_.try_emplace(robot.number, First{placed.x_mm, placed.y_mm, placed.heading_rad, last_s_});
      fmt::format_to(std::back_inserter(tracks), "{},{},{:.10g},{:.10g},{:.10g}\n", run, robot.number, last_s_,
                     placed.x_mm, placed.y_mm);
    }
  }

  void write_experiment(Imported& imported, const std::string& run) {
    proto::Experiment& experiment = imported.experiment;
    experiment.set_name(run);
    // A tick longer than the log, so that its last row takes part.
    experiment.set_duration_s(std::ceil(std::max(1.0, last_s_)));
    experiment.mutable_arena()->set_width_mm(width_mm_);
    experiment.mutable_arena()->set_height_mm(height_mm_);
    proto::RobotGroup& group = *experiment.add_robots();
    group.set_count(static_cast<std::uint32_t>(first_.size()));
    group.set_body(proto::RobotGroup::TRACKED);
    PosesFile& poses = imported.poses.emplace_back();
    poses.name = run + "-poses.csv";
    poses.text = "x_mm,y_mm,heading_deg\n";
    group.mutable_layout()->mutable_poses()->set_csv(poses.name);
    std::uint32_t id = 0;
    for (const auto& [number, at] : first_) {
      // A robot at the picture's edge begins beside the wall; the tracker then moves it where it was.
      const auto within = [](double at_mm, double size_mm) {
        return std::clamp(at_mm, -size_mm / 2 + kFromWall_mm, size_mm / 2 - kFromWall_mm);
      };
      fmt::format_to(std::back_inserter(poses.text), "{:.10g},{:.10g},{:.6g}\n", within(at.x_mm, width_mm_),
                     within(at.y_mm, height_mm_), at.heading_rad * 180 / kPi);
      if (!counts_from_0()) {
        proto::NamedRobot& named = *door_.mutable_robots()->add_robot();
        named.set_name(std::to_string(number));
        named.set_robot(id);
      }
      ++id;
    }
    *experiment.add_door() = door_;
  }

  /// Whether the log's numbers are 0, 1, 2...
  [[nodiscard]] bool counts_from_0() const { return first_.rbegin()->first == first_.size() - 1; }

  void add_notes(Imported& imported) const {
    const auto note = [&](std::string text) { imported.notes.push_back(std::move(text)); };
    if (lars_) note("header: nine lines; not taken over");
    note("time: of writing, not of capture; begins with 0 here");
    note(fmt::format(
        "positions: pixels became mm from the centre of a picture of {:g} by {:g} mm, y up; a picture of "
        "another size needs another placement and arena",
        width_mm_, height_mm_));
    if (!lars_)
      note("orientation: to `kilotwin play` alone; ARK derives it from motion, so the tracks leave it out");
    if (has_led_) note("colour: to `kilotwin play` alone; tracks have no LEDs");
    if (has_velocity_) note("velocity: becomes the heading for `kilotwin play`; tracks have positions alone");
    if (!lars_) note("state, if there is one: is the program's own; not taken over");
    note(
        "commands: the log has none; put a commands.csv beside the tracks, or identify assumes that all go "
        "straight");
    if (!counts_from_0())
      note(fmt::format(
          "numbers of robots: {} to {} in the log and the tracks, 0 to {} in the experiment; its door has "
          "the list",
          first_.begin()->first, first_.rbegin()->first, first_.size() - 1));
    const auto late =
        std::count_if(first_.begin(), first_.end(), [](const auto& e) { return e.second.time_s > 0; });
    if (late > 0)
      note(fmt::format("{} robots are not in the first row; they begin where the log first shows them", late));
    if (lost_ > 0) note(fmt::format("{} positions are no numbers: the robot was lost; left out", lost_));
    if (outside_ > 0)
      note(fmt::format("{} positions lie outside the picture; check the size of a pixel", outside_));
  }

  const std::filesystem::path file_;
  const bool lars_;
  proto::Door door_;
  Imported imported_;
  double width_mm_ = 0, height_mm_ = 0, begin_s_ = 0, last_s_ = 0;
  std::map<std::uint64_t, First> first_;  ///< by the log's number
  std::size_t rows_ = 0, lost_ = 0, outside_ = 0;
  bool has_led_ = false, has_velocity_ = false;
};

}  // namespace

ImportedLog from_tracker_log(const std::filesystem::path& file, const LogOptions& options) {
  return LogImport(file, options).result();
}

}  // namespace kilotwin::importers

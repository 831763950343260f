#include "clients/doors/logs/log_player.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin::doors {

LogExtent check_log(const std::filesystem::path& file, const proto::LogDoor& log) {
  LogReader reader(file, log);
  LogExtent extent;
  while (const auto row = reader.next()) {
    if (extent.rows++ == 0) extent.first_s = row->time_s;
    extent.last_s = row->time_s;
  }
  if (extent.rows > 0) return extent;
  throw UserError(fmt::format("{}:1:1: there is no row; a log holds a row per frame", one_line(file.string())));
}

LogPlayer::LogPlayer(const Door& door, std::filesystem::path file, const LogExtent& extent, double speed, bool loop)
    : door_(door),
      file_(std::move(file)),
      extent_(extent),
      speed_(speed),
      loop_(loop),
      reader_(file_, door.settings.log()) {}

std::optional<TrackedRobot> LogPlayer::placed(const LogRobot& robot) {
  const auto id = door_.names.of_number(robot.number);
  const std::string example = fmt::format("number {}", robot.number);
  if (!id) {
    tally_.left_out("poses that belong to no tracked robot", example);
    return std::nullopt;
  }
  TrackedRobot out;
  out.robot = *id;
  if (door_.placement.place_point(robot.x, robot.y, out) != Fault::kNone) {
    tally_.left_out("poses that are not finite", example);
    return std::nullopt;
  }
  if (robot.heading_rad) {
    door_.placement.place_heading(*robot.heading_rad, out);
  } else if (robot.vx && std::isfinite(*robot.vx + *robot.vy) && std::hypot(*robot.vx, *robot.vy) > 0) {
    door_.placement.place_heading(door_.placement.heading_of(*robot.vx, *robot.vy), out);
  }
  out.led = robot.led;
  return out;
}

std::optional<LogPlayer::Due> LogPlayer::next() {
  constexpr double kNsPerS = 1e9;
  std::optional<LogRow> row = reader_.next();
  if (!row && loop_) {
    const double length_s = extent_.last_s - extent_.first_s;
    const double period_s = extent_.rows > 1 ? length_s / static_cast<double>(extent_.rows - 1) : 1;
    begins_s_ += length_s + (period_s > 0 ? period_s : 1);
    reader_ = LogReader(file_, door_.settings.log());
    row = reader_.next();
  }
  if (!row) return std::nullopt;
  Due due;
  due.after_ns = std::llround((begins_s_ + row->time_s - extent_.first_s) / speed_ * kNsPerS);
  due.frame.frame = frame_++;
  due.frame.capture_ns = due.after_ns;
  for (const LogRobot& robot : row->robots) {
    if (auto each = placed(robot)) due.frame.robots.push_back(*each);
  }
  tally_.passed(due.frame.robots.size());
  return due;
}

}  // namespace kilotwin::doors

#include "clients/cameras/scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.hpp"

namespace kilotwin::cameras {

Scene scene_of(const observe::SwarmAt& now, const observe::SwarmAt* earlier) {
  Scene scene;
  const SwarmView& swarm = now.swarm;
  const double passed_s = earlier == nullptr ? 0 : now.time_s - earlier->time_s;
  for (std::uint32_t robot = 0; robot < swarm.robots(); ++robot) {
    RobotView view;
    view.robot = robot;
    view.pose = {swarm.x_mm[robot], swarm.y_mm[robot], swarm.heading_rad[robot]};
    view.led = swarm.led[robot];
    if (passed_s > 0) {
      const SwarmView& before = earlier->swarm;
      view.vx_mm_s = (view.pose.x_mm - before.x_mm[robot]) / passed_s;
      view.vy_mm_s = (view.pose.y_mm - before.y_mm[robot]) / passed_s;
      view.turn_rad_s = wrapped(view.pose.heading_rad - before.heading_rad[robot]) / passed_s;
    }
    scene.robots.push_back(view);
  }
  for (std::size_t body = 0; body < swarm.movable_x_mm.size(); ++body)
    scene.movables.push_back({swarm.movable_x_mm[body], swarm.movable_y_mm[body], swarm.movable_heading_rad[body]});
  return scene;
}

RecordedScenes::RecordedScenes(const std::filesystem::path& recording) : reader_(recording) {
  const proto::StateRecord* const first = reader_.next_state();
  if (first == nullptr) throw UserError(fmt::format("{}: holds no state; record one first", recording.string()));
  before_ = after_ = *first;
  first_s_ = seconds_of(before_);
}

double RecordedScenes::seconds_of(const proto::StateRecord& state) const {
  return reader_.tick_length().seconds_at(Tick{state.tick()});
}

std::optional<Scene> RecordedScenes::at(double time_s) {
  // A frame at the very time of a state must find it, though both times were rounded.
  constexpr double kSlack_s = 1e-9;
  while (seconds_of(after_) + kSlack_s < time_s) {
    const proto::StateRecord* const next = reader_.next_state();
    if (next == nullptr) return std::nullopt;
    before_ = std::move(after_);
    after_ = *next;
  }
  const double passed_s = seconds_of(after_) - seconds_of(before_);
  const double share = passed_s > 0 ? std::clamp((time_s - seconds_of(before_)) / passed_s, 0.0, 1.0) : 0;
  const proto::StateRecord& of_led = share < 1 ? before_ : after_;
  Scene scene;
  for (int robot = 0; robot < before_.x_mm_size(); ++robot) {
    const double dx_mm = after_.x_mm(robot) - before_.x_mm(robot), dy_mm = after_.y_mm(robot) - before_.y_mm(robot);
    const double turn_rad = wrapped(after_.heading_rad(robot) - before_.heading_rad(robot));
    RobotView view;
    view.robot = static_cast<std::uint32_t>(robot);
    view.pose = {before_.x_mm(robot) + share * dx_mm, before_.y_mm(robot) + share * dy_mm,
                 wrapped(before_.heading_rad(robot) + share * turn_rad)};
    view.led = static_cast<std::uint8_t>(of_led.led()[static_cast<std::size_t>(robot)]);
    if (passed_s > 0) {
      view.vx_mm_s = dx_mm / passed_s;
      view.vy_mm_s = dy_mm / passed_s;
      view.turn_rad_s = turn_rad / passed_s;
    }
    scene.robots.push_back(view);
  }
  for (int body = 0; body < before_.movable_x_mm_size(); ++body) {
    const double turn_rad = wrapped(after_.movable_heading_rad(body) - before_.movable_heading_rad(body));
    scene.movables.push_back({std::lerp(before_.movable_x_mm(body), after_.movable_x_mm(body), share),
                              std::lerp(before_.movable_y_mm(body), after_.movable_y_mm(body), share),
                              before_.movable_heading_rad(body) + share * turn_rad});
  }
  return scene;
}

}  // namespace kilotwin::cameras

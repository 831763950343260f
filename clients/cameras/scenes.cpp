#include "clients/cameras/scenes.hpp"

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
    if (earlier != nullptr && passed_s > 0) {
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

std::optional<Scene> RecordedScenes::at(double time_s) {
  const std::optional<recorder::Snapshot> now = states_.at(time_s);
  if (!now) return std::nullopt;
  const recorder::Snapshot &before = states_.before(), &after = states_.after();
  const double passed_s = after.time_s - before.time_s;
  Scene scene;
  for (std::size_t robot = 0; robot < now->x_mm.size(); ++robot) {
    RobotView view;
    view.robot = static_cast<std::uint32_t>(robot);
    view.pose = {now->x_mm[robot], now->y_mm[robot], now->heading_rad[robot]};
    view.led = now->led[robot];
    if (passed_s > 0) {
      view.vx_mm_s = (after.x_mm[robot] - before.x_mm[robot]) / passed_s;
      view.vy_mm_s = (after.y_mm[robot] - before.y_mm[robot]) / passed_s;
      view.turn_rad_s = wrapped(after.heading_rad[robot] - before.heading_rad[robot]) / passed_s;
    }
    scene.robots.push_back(view);
  }
  for (std::size_t body = 0; body < now->movable_x_mm.size(); ++body)
    scene.movables.push_back({now->movable_x_mm[body], now->movable_y_mm[body], now->movable_heading_rad[body]});
  return scene;
}

}  // namespace kilotwin::cameras

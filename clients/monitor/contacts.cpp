#include "clients/monitor/contacts.hpp"

#include <algorithm>

#include "core/base/ids.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::monitor {
namespace {

/// As in identification: centres within 36 mm, discs within 4 mm of a wall.
constexpr double kRobots_mm = 36, kWall_mm = 4;

}  // namespace

Contacts::Contacts(const RunPlan& plan, std::span<const std::uint32_t> robots)
    : plan_(plan), robots_(robots.begin(), robots.end()), touches_(robots_.size()) {}

bool Contacts::near_wall(double x_mm, double y_mm) const {
  const Point2 at{x_mm, y_mm};
  if (plan_.world.arena.clearance_mm(at) < kRobotRadius_mm + kWall_mm) return true;
  return std::any_of(plan_.world.obstacles.begin(), plan_.world.obstacles.end(), [&](const ObstacleBody& obstacle) {
    return obstacle.shape.nearest(obstacle.place, at).distance_mm < kRobotRadius_mm + kWall_mm;
  });
}

void Contacts::update(const SwarmView& swarm) {
  by_x_.clear();
  for (std::uint32_t i = 0; i < robots_.size(); ++i) {
    const std::uint32_t robot = robots_[i];
    const bool is_present = LifeCycle{swarm.life_cycle[robot]} != LifeCycle::kAbsent;
    touches_[i] = is_present && near_wall(swarm.x_mm[robot], swarm.y_mm[robot]) ? 1 : 0;
    if (is_present) by_x_.push_back(i);
  }
  const auto x = [&](std::uint32_t i) { return swarm.x_mm[robots_[i]]; };
  const auto y = [&](std::uint32_t i) { return swarm.y_mm[robots_[i]]; };
  std::sort(by_x_.begin(), by_x_.end(),
            [&](std::uint32_t a, std::uint32_t b) { return x(a) != x(b) ? x(a) < x(b) : a < b; });
  for (std::size_t n = 0; n < by_x_.size(); ++n) {
    for (std::size_t m = n + 1; m < by_x_.size() && x(by_x_[m]) - x(by_x_[n]) < kRobots_mm; ++m) {
      const double dx = x(by_x_[m]) - x(by_x_[n]), dy = y(by_x_[m]) - y(by_x_[n]);
      if (dx * dx + dy * dy < kRobots_mm * kRobots_mm) touches_[by_x_[n]] = touches_[by_x_[m]] = 1;
    }
  }
}

}  // namespace kilotwin::monitor

#include "services/physics/bodies.hpp"

#include <algorithm>

namespace kilotwin::physics {

void Bodies::clear() {
  robot.clear();
  x_mm.clear();
  y_mm.clear();
  heading_rad.clear();
  tracked.clear();
  awake.clear();
}

void Bodies::add(std::uint32_t id, double x, double y, double heading, std::uint8_t is_tracked, std::uint8_t is_awake) {
  robot.push_back(id);
  x_mm.push_back(x);
  y_mm.push_back(y);
  heading_rad.push_back(heading);
  tracked.push_back(is_tracked);
  awake.push_back(is_awake);
}

void Bodies::add(const Bodies& other, std::size_t i) {
  add(other.robot[i], other.x_mm[i], other.y_mm[i], other.heading_rad[i], other.tracked[i], other.awake[i]);
}

void Bodies::assign_sorted(const Bodies& all, std::vector<std::uint32_t>& order) {
  order.resize(all.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  // Copies of a robot are told apart by their place, so that no two entries compare equal.
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return all.robot[a] != all.robot[b] ? all.robot[a] < all.robot[b] : a < b;
  });
  clear();
  for (const std::uint32_t i : order) {
    if (robot.empty() || robot.back() != all.robot[i]) add(all, i);
  }
}

void Bodies::swap(Bodies& other) noexcept {
  robot.swap(other.robot);
  x_mm.swap(other.x_mm);
  y_mm.swap(other.y_mm);
  heading_rad.swap(other.heading_rad);
  tracked.swap(other.tracked);
  awake.swap(other.awake);
}

}  // namespace kilotwin::physics

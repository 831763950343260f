#include "services/physics/bodies.hpp"

namespace kilotwin::physics {

void Bodies::clear() {
  robot.clear();
  x_mm.clear();
  y_mm.clear();
  heading_rad.clear();
  tracked.clear();
  awake.clear();
  memory.clear();
}

void Bodies::add(std::uint32_t id, double x, double y, double heading, std::uint8_t is_tracked,
                 std::uint8_t is_awake) {
  robot.push_back(id);
  x_mm.push_back(x);
  y_mm.push_back(y);
  heading_rad.push_back(heading);
  tracked.push_back(is_tracked);
  awake.push_back(is_awake);
  memory.resize(memory.size() + remembered, 0);
}

void Bodies::add(const Bodies& other, std::size_t i) {
  add(other.robot[i], other.x_mm[i], other.y_mm[i], other.heading_rad[i], other.tracked[i], other.awake[i]);
  for (std::size_t m = 0; m < remembered; ++m)
    memory[memory.size() - remembered + m] = other.memory[i * remembered + m];
}

void Bodies::resize(std::size_t size) {
  robot.resize(size);
  x_mm.resize(size);
  y_mm.resize(size);
  heading_rad.resize(size);
  tracked.resize(size);
  awake.resize(size);
  memory.resize(size * remembered);
}

void Bodies::insert(std::size_t at) {
  const auto there = static_cast<std::ptrdiff_t>(at);
  robot.insert(robot.begin() + there, 0);
  for (auto* const column : {&x_mm, &y_mm, &heading_rad}) column->insert(column->begin() + there, 0);
  for (auto* const column : {&tracked, &awake}) column->insert(column->begin() + there, 0);
  memory.insert(memory.begin() + static_cast<std::ptrdiff_t>(at * remembered), remembered, 0);
}

void Bodies::erase(std::size_t at) {
  const auto there = static_cast<std::ptrdiff_t>(at);
  robot.erase(robot.begin() + there);
  for (auto* const column : {&x_mm, &y_mm, &heading_rad}) column->erase(column->begin() + there);
  for (auto* const column : {&tracked, &awake}) column->erase(column->begin() + there);
  const auto first = memory.begin() + static_cast<std::ptrdiff_t>(at * remembered);
  memory.erase(first, first + static_cast<std::ptrdiff_t>(remembered));
}

void Bodies::set(std::size_t to, const Bodies& other, std::size_t i) {
  robot[to] = other.robot[i];
  x_mm[to] = other.x_mm[i];
  y_mm[to] = other.y_mm[i];
  heading_rad[to] = other.heading_rad[i];
  tracked[to] = other.tracked[i];
  awake[to] = other.awake[i];
  for (std::size_t m = 0; m < remembered; ++m) memory[to * remembered + m] = other.memory[i * remembered + m];
}

void Bodies::swap(Bodies& other) noexcept {
  robot.swap(other.robot);
  x_mm.swap(other.x_mm);
  y_mm.swap(other.y_mm);
  heading_rad.swap(other.heading_rad);
  tracked.swap(other.tracked);
  awake.swap(other.awake);
  memory.swap(other.memory);
}

}  // namespace kilotwin::physics

/// Bodies in ascending order of their robots' ids, structure of arrays. The state of a body is its pose; there is no velocity.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kilotwin::physics {

struct Bodies {
  std::vector<std::uint32_t> robot;
  std::vector<double> x_mm, y_mm, heading_rad;  ///< heading in [-pi, pi)
  std::vector<std::uint8_t> tracked;            ///< 1: a real robot; not driven, not moved by others
  /// 1: the surroundings must be searched in the next step even if the body rests, because it moved, overlapped or came
  /// new. It spares work and never changes a result.
  std::vector<std::uint8_t> awake;
  /// What the model's effects remember: `remembered` values per body.
  std::vector<double> memory;
  std::size_t remembered = 0;

  [[nodiscard]] std::size_t size() const { return robot.size(); }
  void clear();
  /// Remembers zeros.
  void add(std::uint32_t id, double x, double y, double heading, std::uint8_t is_tracked, std::uint8_t is_awake);
  void add(const Bodies& other, std::size_t i);
  void resize(std::size_t);
  /// Overwrites entry `to`.
  void set(std::size_t to, const Bodies& other, std::size_t i);
  void swap(Bodies& other) noexcept;
  [[nodiscard]] std::span<double> memory_of(std::size_t i) {
    return std::span(memory).subspan(i * remembered, remembered);
  }
};

}  // namespace kilotwin::physics

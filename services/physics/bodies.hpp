/// Bodies as a structure of arrays, in ascending order of robot ids. The state of a body is its pose; it has no velocity.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kilotwin::physics {

struct Bodies {
  std::vector<std::uint32_t> robot;
  std::vector<double> x_mm, y_mm, heading_rad;  ///< heading in [-pi, pi)
  std::vector<std::uint8_t> tracked;  ///< 1: a real robot, posed by a tracker; neither drives nor contacts move it
  /// 1: the next step must search the body's neighbourhood even if the body is not driven, because the body moved,
  /// overlaps or has just become known. This flag saves work and never changes a result.
  std::vector<std::uint8_t> awake;
  /// Memory of the model's effects: `remembered` values per body.
  std::vector<double> memory;
  std::size_t remembered = 0;

  [[nodiscard]] std::size_t size() const { return robot.size(); }
  void clear();
  /// Appends a body with a memory of zeros.
  void add(std::uint32_t id, double x, double y, double heading, std::uint8_t is_tracked, std::uint8_t is_awake);
  void add(const Bodies& other, std::size_t i);
  void resize(std::size_t);
  /// Makes room for a body before entry `at`.
  void insert(std::size_t at);
  void erase(std::size_t at);
  /// Overwrites entry `to`.
  void set(std::size_t to, const Bodies& other, std::size_t i);
  void swap(Bodies& other) noexcept;
  [[nodiscard]] std::span<double> memory_of(std::size_t i) {
    return std::span(memory).subspan(i * remembered, remembered);
  }
};

}  // namespace kilotwin::physics

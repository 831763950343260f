/// Spatial hash of placed robots. Its memory depends on the number of robots, not on the size of the arena.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/state_hash.hpp"

namespace kilotwin {

class Occupancy {
 public:
  /// Robot i is at (x_mm[i], y_mm[i]). The arrays must outlive this object and keep their size. `cell_mm` is the largest search
  /// distance.
  Occupancy(double cell_mm, const std::vector<double>& x_mm, const std::vector<double>& y_mm)
      : cell_mm_(cell_mm),
        x_mm_(x_mm),
        y_mm_(y_mm),
        next_(x_mm.size(), kNone),
        head_(std::bit_ceil(2 * x_mm.size() + 1), kNone) {}

  void add(std::uint32_t robot) {
    std::uint32_t& head = head_[bucket(cell(x_mm_[robot]), cell(y_mm_[robot]))];
    next_[robot] = head;
    head = robot;
  }

  /// The lowest id of an added robot whose centre is closer to the point than distance_mm, which is at most cell_mm.
  [[nodiscard]] std::optional<std::uint32_t> first_within(double x_mm, double y_mm, double distance_mm) const {
    std::uint32_t lowest = kNone;
    const std::int64_t column = cell(x_mm), row = cell(y_mm);
    for (std::int64_t r = row - 1; r <= row + 1; ++r) {
      for (std::int64_t c = column - 1; c <= column + 1; ++c) {
        // A bucket may hold robots of other cells, so test the distance.
        for (std::uint32_t robot = head_[bucket(c, r)]; robot != kNone; robot = next_[robot]) {
          const double dx_mm = x_mm_[robot] - x_mm, dy_mm = y_mm_[robot] - y_mm;
          if (dx_mm * dx_mm + dy_mm * dy_mm < distance_mm * distance_mm && robot < lowest) lowest = robot;
        }
      }
    }
    return lowest == kNone ? std::nullopt : std::optional{lowest};
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  [[nodiscard]] std::int64_t cell(double at_mm) const {
    const double cells = at_mm / cell_mm_;
    const auto whole = static_cast<std::int64_t>(cells);
    return static_cast<double>(whole) > cells ? whole - 1 : whole;
  }
  [[nodiscard]] std::size_t bucket(std::int64_t column, std::int64_t row) const {
    const std::uint64_t h = hash_mix(static_cast<std::uint64_t>(column) ^ 0x9e3779b97f4a7c15u,
                                     static_cast<std::uint64_t>(row) ^ 0xd6e8feb86659fd93u);
    return h & (head_.size() - 1);
  }

  double cell_mm_;
  const std::vector<double>& x_mm_;
  const std::vector<double>& y_mm_;
  std::vector<std::uint32_t> next_, head_;
};

}  // namespace kilotwin

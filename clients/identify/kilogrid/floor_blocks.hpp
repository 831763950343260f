/// Places of robots in blocks of time: means over what cells heard, which blur and jump.
#pragma once

#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid {

/// Mean places in successive blocks of time, per robot; NaN where it was heard less than twice.
struct FloorBlocks {
  static constexpr double kBlock_s = 10;
  std::vector<std::vector<double>> x_mm, y_mm;  ///< [robot][block]
  std::size_t blocks = 0;

  [[nodiscard]] std::size_t robots() const { return x_mm.size(); }
};
[[nodiscard]] FloorBlocks blocks_of(const FloorRun&);

/// The distance from the nearest wall.
[[nodiscard]] double wall_distance_mm(const Floor&, double x_mm, double y_mm);

}  // namespace kilotwin::kilogrid

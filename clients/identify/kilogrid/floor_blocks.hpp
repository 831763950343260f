/// Positions in time blocks: means over cell reports, which are coarse and noisy.
#pragma once

#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid {

/// Mean positions in successive time blocks per robot. NaN: fewer than two reports.
struct FloorBlocks {
  /// Length of a block. Longer ones average more reports, and hide motion that is shorter.
  static constexpr double kBlock_s = 10;
  std::vector<std::vector<double>> x_mm, y_mm;  ///< [robot][block]
  std::size_t blocks = 0;

  [[nodiscard]] std::size_t robots() const { return x_mm.size(); }
};
[[nodiscard]] FloorBlocks blocks_of(const FloorRun&);

/// Distance from the nearest wall, mm.
[[nodiscard]] double wall_distance_mm(const Floor&, double x_mm, double y_mm);

}  // namespace kilotwin::kilogrid

#include "clients/identify/kilogrid/floor_blocks.hpp"

#include <algorithm>
#include <limits>

namespace kilotwin::kilogrid {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

double wall_distance_mm(const Floor& floor, double x_mm, double y_mm) {
  return std::max(std::min(std::min(x_mm, floor.width_mm - x_mm), std::min(y_mm, floor.height_mm - y_mm)), 0.0);
}

FloorBlocks blocks_of(const FloorRun& run) {
  FloorBlocks blocks;
  blocks.blocks = std::max<std::size_t>(static_cast<std::size_t>(run.duration_s / FloorBlocks::kBlock_s), 2);
  for (const FloorTrack& track : run.tracks) {
    std::vector<double> x(blocks.blocks, 0), y(blocks.blocks, 0), count(blocks.blocks, 0);
    for (std::size_t i = 0; i < track.size(); ++i) {
      const auto k = std::min(static_cast<std::size_t>(track.time_s[i] / FloorBlocks::kBlock_s), blocks.blocks - 1);
      x[k] += track.x_mm[i];
      y[k] += track.y_mm[i];
      ++count[k];
    }
    for (std::size_t k = 0; k < blocks.blocks; ++k) {
      x[k] = count[k] < 2 ? kNan : x[k] / count[k];
      y[k] = count[k] < 2 ? kNan : y[k] / count[k];
    }
    blocks.x_mm.push_back(std::move(x));
    blocks.y_mm.push_back(std::move(y));
  }
  return blocks;
}

}  // namespace kilotwin::kilogrid

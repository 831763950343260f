/// Windows of time of single robots, as numbers that say how the robot moved: what a classifier sees of it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_blocks.hpp"

namespace kilotwin::kilogrid {

/// Features of one robot within one window of time.
struct TrackWindow {
  std::size_t robot;  ///< index in the run
  std::vector<double> feature;
};
[[nodiscard]] const std::vector<std::string>& feature_names();
/// Windows of 200 s, one after the other, in which the robot was heard in at least half of the blocks.
[[nodiscard]] std::vector<TrackWindow> windows_of(const FloorBlocks&, const Floor&);
[[nodiscard]] std::vector<TrackWindow> windows_of(const FloorRun&, const Floor&);

}  // namespace kilotwin::kilogrid

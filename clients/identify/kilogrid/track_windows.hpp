/// Features of robots' tracks in time windows, for the classifier.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_blocks.hpp"

namespace kilotwin::kilogrid {

/// Features of one robot in one window.
struct TrackWindow {
  std::size_t robot;  ///< index in the run
  std::vector<double> feature;
};
[[nodiscard]] const std::vector<std::string>& feature_names();
/// Successive windows of 200 s with reports in at least half of the blocks.
[[nodiscard]] std::vector<TrackWindow> windows_of(const FloorBlocks&, const Floor&);
[[nodiscard]] std::vector<TrackWindow> windows_of(const FloorRun&, const Floor&);

}  // namespace kilotwin::kilogrid

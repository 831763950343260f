/// What can be said of how robots moved, from the cells in which they were heard. Everything is a mean of robots' own sums,
/// so that its uncertainty over robots is known, and is computed in the same way from measured and from simulated runs:
/// what cells blur and lose is in both.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/identify/kilogrid/floor_blocks.hpp"

namespace kilotwin::kilogrid {

/// A row of numbers that belong together.
struct StatisticGroup {
  std::string name;       ///< "msd"
  std::string covariate;  ///< of the contract, that the numbers are over
  std::vector<std::string> labels;
  std::size_t first = 0;  ///< index of the first in all

  [[nodiscard]] std::size_t size() const { return labels.size(); }
};
[[nodiscard]] const std::vector<StatisticGroup>& statistic_groups();
[[nodiscard]] std::size_t statistic_count();

/// A robot's share of each: its sum and how much that counts.
struct RobotSums {
  std::vector<double> sum, weight;
};
/// The group of that name; it must be there.
[[nodiscard]] const StatisticGroup& statistic_group(std::string_view name);
/// Per robot of the run.
[[nodiscard]] std::vector<RobotSums> robot_sums(const FloorRun&, const Floor&);

/// Means over robots of several runs, and the variance of each mean by the spread of the robots.
struct FloorStatistics {
  std::vector<double> value, variance;  ///< NaN where there is nothing to take the mean of
};
[[nodiscard]] FloorStatistics statistics_of(std::span<const RobotSums> robots);

}  // namespace kilotwin::kilogrid

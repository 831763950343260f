/// Summary statistics of motion from cell reports. Each is a mean over robots of per-robot sums, which gives its
/// standard error. Measured and simulated runs use the same computation, so coarse cells and lost reports affect
/// both alike.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/identify/kilogrid/floor_blocks.hpp"

namespace kilotwin::kilogrid {

/// Statistics that belong together: one curve or histogram.
struct StatisticGroup {
  std::string name;       ///< for example "msd"
  std::string covariate;  ///< abscissa, a name of result.json
  std::vector<std::string> labels;
  std::size_t first = 0;  ///< index of its first statistic

  [[nodiscard]] std::size_t size() const { return labels.size(); }
};
[[nodiscard]] const std::vector<StatisticGroup>& statistic_groups();
[[nodiscard]] std::size_t statistic_count();

/// A robot's contribution to each statistic: sum and weight.
struct RobotSums {
  std::vector<double> sum, weight;
};
/// The group of that name, which must exist.
[[nodiscard]] const StatisticGroup& statistic_group(std::string_view name);
/// One per robot of the run.
[[nodiscard]] std::vector<RobotSums> robot_sums(const FloorRun&, const Floor&);

/// Means over the robots of several runs, and their variances by the spread between robots.
struct FloorStatistics {
  std::vector<double> value, variance;  ///< NaN if unknown
};
[[nodiscard]] FloorStatistics statistics_of(std::span<const RobotSums> robots);

}  // namespace kilotwin::kilogrid

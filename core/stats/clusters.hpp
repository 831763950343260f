/// Statistics of trials that depend on each other within clusters, such as those of one data set.
#pragma once

#include <span>
#include <utility>

namespace kilotwin::stats {

struct Cluster {
  double hits = 0, trials = 0;
};

/// 95 % interval of a probability of which clusters tell, independent of each other: Wilson's, of as many independent trials as have the
/// variance between the clusters (Korn and Graubard, Survey Methodology 24, 1998). All hits or none, or a single
/// cluster: of one trial per cluster. At least one trial.
[[nodiscard]] std::pair<double, double> wilson_interval(std::span<const Cluster>);

}  // namespace kilotwin::stats

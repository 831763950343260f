#include "core/stats/clusters.hpp"

#include <algorithm>

#include "core/stats/distributions.hpp"

namespace kilotwin::stats {

std::pair<double, double> wilson_interval(std::span<const Cluster> clusters) {
  double hits = 0, trials = 0, square = 0;
  for (const Cluster& cluster : clusters) {
    hits += cluster.hits;
    trials += cluster.trials;
  }
  const double share = hits / trials, count = static_cast<double>(clusters.size());
  for (const Cluster& cluster : clusters) {
    const double off = cluster.hits - share * cluster.trials;
    square += off * off;
  }
  double independent = count;
  if (count > 1 && square > 0 && share > 0 && share < 1) {
    const double variance = square * count / (count - 1) / (trials * trials),
                 narrower = kNormal95 / student_quantile(0.975, count - 1);
    independent = share * (1 - share) / variance * narrower * narrower;
  }
  independent = std::clamp(independent, 1.0, trials);
  return wilson_interval(share * independent, independent);
}

}  // namespace kilotwin::stats

/// Evidence of effects from scores and information, in nats, and the threshold that bounds false alarms.
#pragma once

#include <array>
#include <cstddef>

#include "clients/monitor/alarm.hpp"

namespace kilotwin::monitor {

/// Score and information of up to three sizes that are tested together.
struct Sums {
  std::size_t dimensions = 1;
  std::array<double, 3> score{};
  /// (0,0), (0,1), (0,2), (1,1), (1,2), (2,2); of unused dimensions 0.
  std::array<double, 6> information{};

  Sums& operator+=(const Sums& other);
  Sums& operator-=(const Sums& other);
};

/// Standard deviations of the sizes before any measurement; a size has the prior N(0, sd^2).
struct SizePrior {
  std::array<double, 3> sd{};
};

/// Log of the likelihood ratio of "sizes drawn from the prior" to "no effect": log E[exp(u b - I b^2 / 2)]. `dispersion` >= 1
/// divides score and information.
[[nodiscard]] double evidence(const Sums& sums, const SizePrior& prior, double dispersion);
/// Upper bound of the evidence, faster.
[[nodiscard]] double evidence_bound(const Sums& sums, const SizePrior& prior, double dispersion);
/// Mean and standard deviation of each size given the sums.
[[nodiscard]] std::array<Size, 3> sizes(const Sums& sums, const SizePrior& prior, double dispersion);

/// The threshold at which `tests` tests that begin every `every_s` alarm falsely at most `per_hour` times per hour, nat.
[[nodiscard]] double threshold_nat(double tests, double every_s, double per_hour);

}  // namespace kilotwin::monitor

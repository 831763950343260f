/// The work of an identification from floors, as units of kinds with costs: for the estimate of the remaining time.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "core/stats/time_left.hpp"

namespace kilotwin::kilogrid {

/// In the order of their first units; the search repeats kEffect.
enum FloorWork { kBase, kEffect, kWalls, kElimination, kChoice, kPredictions, kClassifier, kFloorReport };

/// Effects that a search may add. More cost a test of all candidates and a fit each.
inline constexpr int kMostEffects = 6;

/// A unit that begins. `effects`: of the model, with one that the unit adds.
[[nodiscard]] inline stats::Work floor_work(FloorWork kind, std::string stage, int effects, bool searches) {
  // Most of all costs is the number of simulations: of one fit for the base, of all candidates and a fit for an effect.
  constexpr double kCosts[] = {1, 1.5, 0.7, 0.5, 0.5, 0.3, 0.3, 0.1};
  constexpr double kLikely = 1;
  const double most = searches && kind <= kEffect ? std::max(0, kMostEffects - effects) : 0;
  const double likely = std::min(most, kLikely);
  const auto cost_of = [&](int k, double added) {
    return kCosts[k] * (k == kElimination ? std::max(effects + added - 1, 0.0) : 1);
  };
  stats::Work work{std::move(stage), "", kind, cost_of(kind, 0), {}};
  for (int k = kEffect; k <= kFloorReport; ++k) {
    if (k == kEffect)
      // The last test of all candidates adds nothing.
      work.left.push_back({k, kCosts[k] * likely, kCosts[k] * most});
    else if (k > kind && (searches || k > kElimination))
      work.left.push_back({k, cost_of(k, likely), cost_of(k, most)});
  }
  return work;
}

}  // namespace kilotwin::kilogrid

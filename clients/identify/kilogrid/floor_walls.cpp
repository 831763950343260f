#include "clients/identify/kilogrid/floor_walls.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "clients/identify/kilogrid/fast_swarm.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Statistics of simulated runs; the number selects the random sequence.
using Simulate = std::function<FloorStatistics(const FloorModel&, std::uint64_t)>;

struct Fitted {
  FloorModel model;
  double before, after;  ///< misfit
};

Fitted fitted(FloorModel model, const FloorSet& set, int rounds, const Simulate& simulate) {
  const StatisticGroup& group = statistic_group("occupancy-of-the-rim");
  // Slower robots stay longer. A few blocks carry no information.
  constexpr double kSome = 1e-3, kPower = 0.8, kSlowest = 0.02, kFastest = 1.2;
  FloorStatistics at = simulate(model, 0);
  const double before = set.misfit(at);
  Fitted best{model, before, std::numeric_limits<double>::infinity()};
  if (!model.wall) model.wall.emplace().fill(1);
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < kBoundarySections; ++i) {
      const double ratio = (at.value[group.first + i] + kSome) / (set.statistics.value[group.first + i] + kSome);
      (*model.wall)[i] = std::clamp((*model.wall)[i] * std::pow(ratio, kPower), kSlowest, kFastest);
    }
    at = simulate(model, 1 + static_cast<std::uint64_t>(round));
    if (const double now = set.misfit(at); now < best.after) best = {model, before, now};
  }
  return best;
}

/// Null distribution from sets simulated by the model.
struct NullWalls {
  double bound;   ///< 0.99 quantile of the reduction by walls
  double misfit;  ///< remaining misfit
};
NullWalls by_chance(const FloorModel& model, const FloorTarget& target, int rounds, std::uint64_t seed) {
  // Simulated sets; more make the bound less uncertain, and cost a fit each; kQuantile is for ten.
  constexpr std::size_t kSets = 10;
  const auto sums = [&](const FloorModel& of, std::uint64_t number) {
    std::vector<std::vector<RobotSums>> runs;
    const FloorSettings settings = of.settings();
    for (std::size_t i = 0; i < target.scenes().size(); ++i)
      runs.push_back(
          robot_sums(simulate_fast(target.scenes()[i], target.floor(), settings, seed * 10000 + number * 100 + i),
                     target.floor()));
    return FloorSet(std::move(runs));
  };
  std::vector<double> gains(kSets), left(kSets);
  os::in_parallel(kSets, target.threads(), [&](std::size_t b) {
    const std::uint64_t own = 10 * b;
    const Fitted walls = fitted(model, sums(model, own), rounds, [&](const FloorModel& of, std::uint64_t number) {
      return sums(of, own + 1 + number).statistics;
    });
    gains[b] = walls.before - walls.after;
    left[b] = walls.after;
  });
  double mean = 0, square = 0;
  const double misfit = std::accumulate(left.begin(), left.end(), 0.0) / kSets;
  for (const double gain : gains) {
    mean += gain / kSets;
    square += gain * gain / kSets;
  }
  // The sum of many statistics is nearly normal: Student's t with nine degrees of freedom, 1 %.
  constexpr double kQuantile = 2.821;
  const double variance = std::max(square - mean * mean, 0.0) * kSets / (kSets - 1);
  return {mean + kQuantile * std::sqrt(variance * (1 + 1.0 / kSets)), misfit};
}

}  // namespace

WallGain fit_walls(FloorModel& model, const FloorTarget& target, int rounds, std::uint64_t seed,
                   const FloorProgress& progress) {
  const Fitted walls = fitted(model, target.set(), rounds, [&](const FloorModel& of, std::uint64_t number) {
    return simulated_statistics(target, of.settings(), seed + number);
  });
  progress(fmt::format("beside walls: misfit {:.0f} -> {:.0f}", walls.before, walls.after));
  WallGain gain{walls.before - walls.after, 0};
  if (gain.gain <= 0) return gain;
  // Unexplained misfit inflates the null distribution, as for other effects.
  const NullWalls chance = by_chance(model, target, rounds, seed);
  gain.needed = std::max(chance.bound, 0.0) * std::max(1.0, walls.after / chance.misfit);
  if (gain.found()) model = walls.model;
  return gain;
}

}  // namespace kilotwin::kilogrid

/// The target of the fit: statistics of measured runs, and simulations of the same runs.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"
#include "clients/identify/kilogrid/floor_statistics.hpp"

namespace kilotwin::kilogrid {

/// A run whose robots behaved differently from those of the other runs.
struct UnlikeRun {
  std::size_t run;
  double distance;       ///< mean square over the statistics, relative to differences between the other runs
  std::string worst;     ///< the statistic that deviates most
  double value, others;  ///< of that statistic, in this run and on average in the others
};
/// Needs four runs or more.
[[nodiscard]] std::vector<UnlikeRun> unlike_runs(const std::vector<FloorRun>&, const Floor&);

/// Runs as pooled statistics with tolerances.
struct FloorSet {
  std::vector<std::vector<RobotSums>> runs;
  FloorStatistics statistics;
  /// Variance of each statistic under a perfect model: spread between robots and between runs.
  std::vector<double> tolerance;

  explicit FloorSet(std::vector<std::vector<RobotSums>>);
  /// Sum of squared deviations relative to the tolerance, of one group or of all.
  [[nodiscard]] double misfit(const FloorStatistics&) const;
  [[nodiscard]] double misfit(const FloorStatistics&, const StatisticGroup&) const;
};

/// Measured runs as the target of a fit.
class FloorTarget {
 public:
  /// `threads`: for simulations; no effect on results.
  FloorTarget(const std::vector<FloorRun>&, const Floor&, std::uint32_t threads = 2);
  [[nodiscard]] std::uint32_t threads() const { return threads_; }
  /// The first `longest_s` of each run.
  [[nodiscard]] FloorTarget cut(double longest_s) const;

  [[nodiscard]] const std::vector<FloorScene>& scenes() const { return scenes_; }
  [[nodiscard]] const FloorSet& set() const { return set_; }
  [[nodiscard]] const FloorStatistics& statistics() const { return set_.statistics; }
  [[nodiscard]] const std::vector<double>& tolerance() const { return set_.tolerance; }
  [[nodiscard]] const Floor& floor() const { return floor_; }
  /// Probabilities of the advance of a module's polling by 0..3 cells between reports of a robot; 0 is not known
  /// yet.
  [[nodiscard]] const std::array<double, 4>& later() const { return later_; }
  [[nodiscard]] double misfit(const FloorStatistics& of) const { return set_.misfit(of); }
  [[nodiscard]] double misfit(const FloorStatistics& of, const StatisticGroup& group) const {
    return set_.misfit(of, group);
  }
  /// Number of statistics.
  [[nodiscard]] std::size_t size() const;

 private:
  Floor floor_;
  std::uint32_t threads_;
  std::vector<FloorRun> runs_;
  std::vector<FloorScene> scenes_;
  FloorSet set_;
  std::array<double, 4> later_;
};

/// One simulated run per scene, `repeats` times.
[[nodiscard]] std::vector<FloorRun> simulate_scenes(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                    int repeats = 1);
enum class Simulator { kEngine, kQuick };
/// Per-robot sums of these runs, in the same order.
[[nodiscard]] std::vector<std::vector<RobotSums>> simulated_sums(const FloorTarget&, const FloorSettings&,
                                                                 std::uint64_t seed, int repeats = 1,
                                                                 Simulator by = Simulator::kEngine);
/// Statistics of all robots of these runs, or of the runs `in`.
[[nodiscard]] FloorStatistics pooled(const std::vector<std::vector<RobotSums>>& runs,
                                     const std::function<bool(std::size_t run)>& in = {});
/// Statistics of simulated_sums.
[[nodiscard]] FloorStatistics simulated_statistics(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                   int repeats = 1, Simulator by = Simulator::kEngine);

}  // namespace kilotwin::kilogrid

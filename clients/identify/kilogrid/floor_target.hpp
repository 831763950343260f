/// What a model of the floor is brought near to: the statistics of measured runs, and runs simulated like them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"
#include "clients/identify/kilogrid/floor_statistics.hpp"

namespace kilotwin::kilogrid {

/// A run in which robots did not what they did in the others.
struct UnlikeRun {
  std::size_t run;
  double distance;       ///< mean square over the statistics, in what the other runs differ by
  std::string worst;     ///< the statistic that is farthest off
  double value, others;  ///< of that statistic, here and in the mean of the others
};
/// Of four runs or more.
[[nodiscard]] std::vector<UnlikeRun> unlike_runs(const std::vector<FloorRun>&, const Floor&);

/// Runs as what they have in common, to be compared with others.
struct FloorSet {
  std::vector<std::vector<RobotSums>> runs;
  FloorStatistics statistics;
  /// What a perfect model's statistics would differ by, squared: chance among robots, and differences among runs.
  std::vector<double> tolerance;

  explicit FloorSet(std::vector<std::vector<RobotSums>>);
  /// How many times the tolerance the statistics lie off, squared and summed; of one group, or of all.
  [[nodiscard]] double misfit(const FloorStatistics&) const;
  [[nodiscard]] double misfit(const FloorStatistics&, const StatisticGroup&) const;
};

/// Measured runs, as what is fitted to.
class FloorTarget {
 public:
  /// `threads`: for simulated runs, without effect on them.
  FloorTarget(const std::vector<FloorRun>&, const Floor&, std::uint32_t threads = 2);
  [[nodiscard]] std::uint32_t threads() const { return threads_; }
  /// Of each run the first `longest_s` alone.
  [[nodiscard]] FloorTarget cut(double longest_s) const;

  [[nodiscard]] const std::vector<FloorScene>& scenes() const { return scenes_; }
  [[nodiscard]] const FloorSet& set() const { return set_; }
  [[nodiscard]] const FloorStatistics& statistics() const { return set_.statistics; }
  [[nodiscard]] const std::vector<double>& tolerance() const { return set_.tolerance; }
  [[nodiscard]] const Floor& floor() const { return floor_; }
  /// By which of its cells a module hears a robot next, counted from the last: chances of 0..3; that of 0 is not known yet.
  [[nodiscard]] const std::array<double, 4>& later() const { return later_; }
  [[nodiscard]] double misfit(const FloorStatistics& of) const { return set_.misfit(of); }
  [[nodiscard]] double misfit(const FloorStatistics& of, const StatisticGroup& group) const {
    return set_.misfit(of, group);
  }
  /// How many statistics there are.
  [[nodiscard]] std::size_t size() const;

 private:
  Floor floor_;
  std::uint32_t threads_;
  std::vector<FloorRun> runs_;
  std::vector<FloorScene> scenes_;
  FloorSet set_;
  std::array<double, 4> later_;
};

/// Calls work(0), work(1)... work(n - 1), on several threads.
void in_parallel(std::uint32_t threads, std::size_t n, const std::function<void(std::size_t)>& work);

/// One simulated run per scene, `repeats` times.
[[nodiscard]] std::vector<FloorRun> simulate_scenes(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                    int repeats = 1);
enum class Simulator { kEngine, kQuick };
/// Sums of these runs' robots, in the same order.
[[nodiscard]] std::vector<std::vector<RobotSums>> simulated_sums(const FloorTarget&, const FloorSettings&,
                                                                 std::uint64_t seed, int repeats = 1,
                                                                 Simulator by = Simulator::kEngine);
/// Statistics of all these runs' robots together, or of the runs that are `in`.
[[nodiscard]] FloorStatistics pooled(const std::vector<std::vector<RobotSums>>& runs,
                                     const std::function<bool(std::size_t run)>& in = {});
/// Of simulated_sums.
[[nodiscard]] FloorStatistics simulated_statistics(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                   int repeats = 1, Simulator by = Simulator::kEngine);

}  // namespace kilotwin::kilogrid

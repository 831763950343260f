/// A model of the floor fitted by simulation: the statistics of simulated runs are brought near those of measured ones.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"
#include "clients/identify/kilogrid/floor_statistics.hpp"

namespace kilotwin::kilogrid {

/// Measured runs, as what is fitted to.
class FloorTarget {
 public:
  FloorTarget(const std::vector<FloorRun>&, const Floor&);

  [[nodiscard]] const std::vector<FloorScene>& scenes() const { return scenes_; }
  [[nodiscard]] const FloorStatistics& statistics() const { return statistics_; }
  /// What a perfect model's statistics would differ by, squared: chance among robots, and differences among runs.
  [[nodiscard]] const std::vector<double>& tolerance() const { return tolerance_; }
  [[nodiscard]] const Floor& floor() const { return floor_; }
  /// By which of its cells a module hears a robot next, counted from the last: chances of 0..3; that of 0 is not known yet.
  [[nodiscard]] const std::array<double, 4>& later() const { return later_; }
  /// How many times the tolerance the statistics lie off, squared and summed; of one group, or of all.
  [[nodiscard]] double misfit(const FloorStatistics&) const;
  [[nodiscard]] double misfit(const FloorStatistics&, const StatisticGroup&) const;
  /// How many statistics there are.
  [[nodiscard]] std::size_t size() const;

 private:
  Floor floor_;
  std::vector<FloorScene> scenes_;
  FloorStatistics statistics_;
  std::vector<double> tolerance_;
  std::array<double, 4> later_;
};

/// One simulated run per scene, `repeats` times.
[[nodiscard]] std::vector<FloorRun> simulate_scenes(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                    int repeats = 1);
[[nodiscard]] FloorStatistics simulated_statistics(const FloorTarget&, const FloorSettings&, std::uint64_t seed,
                                                   int repeats = 1);

/// What the neighbourhood of a model says about a candidate.
struct CandidateScore {
  std::size_t candidate;
  double gain;                 ///< by how much it would lower the misfit
  std::vector<double> values;  ///< of its parameters
};

using FloorProgress = std::function<void(const std::string&)>;

/// Regresses the statistics on all parameters over a design of simulated runs, and goes to where they fit best; `rounds` times
/// with ever smaller steps; `with_rim`: the messages of each part of the rim as well. Returns the misfit at the end, by new simulations.
double fit(FloorModel&, const FloorTarget&, int rounds, double width, bool with_rim, std::uint64_t seed,
           const FloorProgress&);

/// Candidates that the model lacks, one after the other by what each removes of the misfit beside those before it and with the
/// model refitted; ends where the next would remove less than `least_gain`.
[[nodiscard]] std::vector<CandidateScore> choose(const FloorModel&, const std::vector<FloorTerm>& candidates,
                                                 const FloorTarget&, double least_gain, std::uint64_t seed,
                                                 const FloorProgress&);

}  // namespace kilotwin::kilogrid

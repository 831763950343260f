/// Selection of the most significant missing effect.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_fit.hpp"

namespace kilotwin::kilogrid {

/// Test of one candidate, by a linearisation about the model.
struct CandidateScore {
  double gain = 0;             ///< reduction of the misfit after a refit
  double needed = 0;           ///< significance bound of the gain
  double evidence = 0;         ///< negative logarithm of the p value
  std::vector<double> by_run;  ///< cross-validated reduction of each run's misfit; empty with fewer than three runs
  std::vector<double> values;  ///< of its parameters

  double uncorrected_evidence = 0;  ///< evidence without the correction for unexplained misfit

  /// Whether it reduces the misfit of held-out runs: in total, and in at least three of four runs.
  [[nodiscard]] bool helps_held_out() const;
  /// Whether it reduces the misfit of each held-out run consistently: Student's t test over runs, 1 %.
  [[nodiscard]] bool consistent_over_runs() const;
  /// Unexplained misfit inflates the null distribution, unless the runs agree on the effect.
  [[nodiscard]] bool beyond(double bound) const {
    return (evidence > bound && helps_held_out()) || (uncorrected_evidence > bound && consistent_over_runs());
  }
};

struct Selection {
  std::vector<CandidateScore> scores;  ///< one per candidate
  std::size_t best =
      0;              ///< the most evidence among significant candidates, else among those that help held-out runs
  double bound = 0;   ///< 0.99 quantile of the largest evidence in sets without an effect
  double misfit = 0;  ///< of the refitted model, with correlations
  double by_chance = 0;     ///< misfit of sets simulated by the model
  double unexplained = 1;   ///< misfit beyond all candidates, relative to simulated sets
  std::size_t numbers = 0;  ///< number of statistics in the misfit

  [[nodiscard]] bool found() const { return !scores.empty() && scores[best].beyond(bound); }
};

/// Tests each candidate against sets simulated by the model, with the measured numbers of runs and robots, initial
/// positions and durations.
[[nodiscard]] Selection choose(const FloorModel&, const std::vector<FloorTerm>& candidates, const FloorTarget&,
                               std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

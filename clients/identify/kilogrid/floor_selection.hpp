/// Which effect a model of the floor lacks most, and whether that is beyond chance.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_fit.hpp"

namespace kilotwin::kilogrid {

/// What the neighbourhood of a model says about a candidate.
struct CandidateScore {
  double gain = 0;      ///< by how much it would lower the misfit, with the model refitted
  double needed = 0;    ///< that much is beyond chance
  double evidence = 0;  ///< negative logarithm of the chance of such a gain
  std::vector<double>
      by_run;  ///< what it removes of each run's misfit, learned from the others; empty of fewer than three
  std::vector<double> values;  ///< of its parameters

  double by_chance_alone = 0;  ///< evidence, as if the model left nothing but chance beside it

  /// Whether it helps with runs that it was not learned from: all together, and each but one of four.
  [[nodiscard]] bool helps_others() const;
  /// Whether it helps with each of them, alike: by a mean that is beyond what they differ by (Student, 1 %).
  [[nodiscard]] bool helps_all_alike() const;
  /// What the model leaves unexplained may look like an effect, so that counts as chance; but not where runs agree.
  [[nodiscard]] bool beyond(double bound) const {
    return (evidence > bound && helps_others()) || (by_chance_alone > bound && helps_all_alike());
  }
};

struct Choice {
  std::vector<CandidateScore> scores;  ///< of each candidate
  std::size_t best =
      0;              ///< with the most evidence, of those that are beyond chance, else that help with other runs
  double bound = 0;   ///< of evidence: the largest of all is beyond it in one of 100 sets without an effect
  double misfit = 0;  ///< where the model stands, refitted, with correlations
  double by_chance = 0;     ///< that of sets that the model made
  double unexplained = 1;   ///< what is left with all candidates, in what is left of those sets
  std::size_t numbers = 0;  ///< that it is of

  [[nodiscard]] bool found() const { return !scores.empty() && scores[best].beyond(bound); }
};

/// Weighs each candidate that the model lacks against sets simulated by the model: as many runs and robots as measured, from
/// the same places, as long.
[[nodiscard]] Choice choose(const FloorModel&, const std::vector<FloorTerm>& candidates, const FloorTarget&,
                            std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

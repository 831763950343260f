/// Whether an effect is beyond chance: what it removes of the misfit, against what it removes of sets that were simulated
/// without it. Numbers of one set go together, so the misfit is taken with their correlations.
#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "clients/identify/kilogrid/floor_sensitivity.hpp"

namespace kilotwin::kilogrid {

/// How far simulated statistics are from measured ones, as a quadratic function of steps of the parameters.
struct FloorGap {
  Eigen::MatrixXd curve;  ///< per pair of parameters
  Eigen::VectorXd pull;
  double misfit = 0;  ///< where the model stands
  std::size_t numbers = 0;

  /// `correlation` of statistics in sets like these.
  FloorGap(const FloorSet& measured, const FloorStatistics& simulated, const Eigen::MatrixXd& slopes,
           const Eigen::MatrixXd& correlation);
  /// The steps that lower it most, of parameters in use and within the box.
  [[nodiscard]] Eigen::VectorXd best_steps(const std::vector<bool>& in_use, const FloorBox&) const;
  [[nodiscard]] double at(const Eigen::VectorXd& steps) const;
};

/// Correlations of statistics over robots of simulated sets, each set's about its own means. Statistics that are not known have none.
[[nodiscard]] Eigen::MatrixXd correlation_of(std::span<const FloorSet> sets);

/// What candidates remove of sets without any of them: how much is by chance.
class FloorChance {
 public:
  /// `gains`: [set][candidate]; `switches`: of each candidate, the numbers that were free.
  FloorChance(const std::vector<std::vector<double>>& gains, const std::vector<std::size_t>& switches);

  /// How unlikely so much is by chance for this candidate: the negative logarithm of the probability.
  [[nodiscard]] double evidence(std::size_t candidate, double gain) const;
  /// What the largest of all candidates' is beyond in one of 100 sets without an effect.
  [[nodiscard]] double bound() const { return bound_; }
  /// The gain that has this evidence.
  [[nodiscard]] double gain_of(std::size_t candidate, double evidence) const;

 private:
  /// From all sets but one.
  [[nodiscard]] std::vector<double> scales_of(const std::vector<std::vector<double>>& gains, std::size_t but) const;

  std::vector<std::size_t> switches_;
  std::vector<double> scale_;  ///< of the chi-square distribution that a candidate's gains have
  double bound_ = 0;
};

}  // namespace kilotwin::kilogrid

/// Significance of an effect: its reduction of the misfit, compared with sets simulated without it. Statistics are
/// correlated, so the misfit uses their correlation matrix.
#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "clients/identify/kilogrid/floor_sensitivity.hpp"

namespace kilotwin::kilogrid {

/// Misfit between simulated and measured statistics as a quadratic function of parameter steps.
struct FloorMisfit {
  Eigen::MatrixXd curve;  ///< Hessian: parameters x parameters
  Eigen::VectorXd gradient;
  double misfit = 0;  ///< at the model's parameters
  std::size_t numbers = 0;

  /// `correlation`: of the statistics over robots.
  FloorMisfit(const FloorSet& measured, const FloorStatistics& simulated, const Eigen::MatrixXd& slopes,
              const Eigen::MatrixXd& correlation);
  /// Minimises the misfit over the parameters in use, within the box.
  [[nodiscard]] Eigen::VectorXd best_steps(const std::vector<bool>& in_use, const FloorBox&) const;
  [[nodiscard]] double at(const Eigen::VectorXd& steps) const;
};

/// Correlations of statistics over robots of simulated sets, each about its set's means. Unknown statistics are
/// uncorrelated.
[[nodiscard]] Eigen::MatrixXd correlation_of(std::span<const FloorSet> sets);

/// Null distribution of the misfit reductions of candidates.
class NullDistribution {
 public:
  /// `gains`: [set][candidate], of sets without an effect. `switches`: free parameters of each candidate.
  NullDistribution(const std::vector<std::vector<double>>& gains, const std::vector<std::size_t>& switches);

  /// Negative logarithm of the p value of a gain.
  [[nodiscard]] double evidence(std::size_t candidate, double gain) const;
  /// 0.99 quantile, over sets without an effect, of the largest evidence of all candidates.
  [[nodiscard]] double bound() const { return bound_; }
  /// The gain with this evidence.
  [[nodiscard]] double gain_of(std::size_t candidate, double evidence) const;

 private:
  /// Scales from all sets except one.
  [[nodiscard]] std::vector<double> scales_of(const std::vector<std::vector<double>>& gains, std::size_t but) const;

  std::vector<std::size_t> switches_;
  std::vector<double> scale_;  ///< of the scaled chi-square distribution of a candidate's gains
  double bound_ = 0;
};

}  // namespace kilotwin::kilogrid

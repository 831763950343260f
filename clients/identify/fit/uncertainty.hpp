/// Uncertainty of a fitted model: the posterior covariance of its parameters, in Laplace's approximation.
#pragma once

#include <Eigen/Core>
#include <map>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/held_numbers.hpp"

namespace kilotwin::identify {

/// The posterior of a robot's biases where base parameters and coefficients are known.
struct GivenBiases {
  Eigen::Matrix2d covariance;
  Eigen::MatrixXd by_column;  ///< by how much the mean moves with each base parameter and coefficient; 2 x columns
};

struct Uncertainty {
  /// Of the base parameters (BaseColumn), then of the coefficients of all terms in order, where the held numbers are known.
  Eigen::MatrixXd covariance;
  HeldNumbers held;
  /// Of all parameters: base parameters, coefficients, then the held numbers.
  Eigen::MatrixXd all;
  double bias_mean_sd_mm_s = 0, bias_sd_sd_mm_s = 0;  ///< of BaseParameters::bias_mean_mm_s and bias_sd_mm_s
  double dispersion =
      1;  ///< variance of the scores of clusters over what the information expects; in all covariances
  /// Of the biases of each robot, with that of all parameters.
  std::map<std::uint32_t, Eigen::Matrix2d> biases;
  std::map<std::uint32_t, GivenBiases> given;

  [[nodiscard]] double sd(Eigen::Index column) const { return std::sqrt(std::max(0.0, all(column, column))); }
};

/// At the maximum of the likelihood with its priors, as a fit leaves the state. Clusters of 100 s whose scores vary more than
/// the model expects widen the covariance.
[[nodiscard]] Uncertainty uncertainty_of(const Fitter&, const FitState&);

}  // namespace kilotwin::identify

/// Uncertainty of a fitted model: the posterior covariance of its parameters, in Laplace's approximation.
#pragma once

#include <Eigen/Core>
#include <map>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// The posterior of a robot's biases where base parameters and coefficients are known.
struct GivenBiases {
  Eigen::Matrix2d covariance;
  Eigen::MatrixXd by_column;  ///< by how much the mean moves with each base parameter and coefficient; 2 x columns
};

struct Uncertainty {
  /// Of the base parameters (BaseColumn), then of the coefficients of all terms in order.
  Eigen::MatrixXd covariance;
  /// Of the biases of each robot, with that of the base parameters and coefficients.
  std::map<std::uint32_t, Eigen::Matrix2d> biases;
  std::map<std::uint32_t, GivenBiases> given;

  [[nodiscard]] double sd(Eigen::Index column) const {
    return std::sqrt(std::max(0.0, covariance(column, column)));
  }
};

/// At the maximum of the likelihood with its priors, as a fit leaves the state. Clusters of 100 s whose scores vary more than
/// the model expects widen the covariance.
[[nodiscard]] Uncertainty uncertainty_of(const Fitter&, const FitState&);

/// The value of a curve or map at a situation, and its standard deviation.
struct ValueWithSd {
  double value, sd;
};
/// Block `block` of term `term` at a situation; `covariance`: of Uncertainty.
[[nodiscard]] ValueWithSd value_of(const MotionModel&, std::size_t term, std::size_t block, const Situation&,
                                   const Eigen::MatrixXd& covariance);

}  // namespace kilotwin::identify

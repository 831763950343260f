#include "clients/identify/fit/noise_restriction.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {
namespace {

double log_determinant(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd scaled =
      scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
  return scaled.ldlt().vectorD().cwiseMax(1e-300).array().log().sum() + 2 * scale.array().log().sum();
}

}  // namespace

double NoiseRestriction::operator()(const FittedVariances& variances) const {
  return 0.5 * columns * std::log(std::max(1e-12, other + weights.dot(variances)));
}

NoiseRestriction noise_restriction(const Fitter& fitter, const FitState& state, double share) {
  const FittedVariances at = fitted_variances(state.model.noise), usual = fitted_variances(Noise{});
  const auto information_at = [&](const FittedVariances& v) {
    FitState other = state;
    other.model.noise = with_fitted(other.model.noise, v);
    return log_determinant(fitter.information(other));
  };
  const double here = information_at(at);
  NoiseRestriction out;
  // Twice the variances: a column of which the data decide loses a factor of 2, one of which its prior decides loses nothing.
  const double of_all = (here - information_at(2 * at)) / std::log(2.0);
  if (of_all < 1) return out;
  // A variance near zero has no gradient in its logarithm, so that each is raised by some of its usual value.
  constexpr double kLeastRise = 0.05;
  for (Eigen::Index i = 0; i < fitted_variance::kCount; ++i) {
    const double rise = std::max(at[i], kLeastRise * usual[i]);
    FittedVariances raised = at;
    raised[i] += rise;
    out.weights[i] = std::max(0.0, std::expm1((here - information_at(raised)) / of_all) / rise);
  }
  out.other = std::max(0.0, 1 - out.weights.dot(at));
  out.columns = share * of_all;
  return out;
}

}  // namespace kilotwin::identify

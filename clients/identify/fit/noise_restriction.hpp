/// The part of the noise that estimated columns follow, so that the noise of maximum likelihood is too small where a
/// map with many columns was fitted. The restricted likelihood (Patterson and Thompson 1971, Biometrika 58) is the integral over the
/// columns; in Laplace's approximation it adds -log|I(v)| / 2, where I is the information of the columns under the variances v.
#pragma once

#include "clients/identify/fit/fitted_variances.hpp"

namespace kilotwin::identify {

class Fitter;
struct FitState;

/// log|I(v)| as -columns log(other + sum of weights v): exact if one variance decides about the information of every column.
struct NoiseRestriction {
  double columns = 0;  ///< number of columns that the data decide about, scaled by `share`
  FittedVariances weights = FittedVariances::Zero();  ///< one over variance
  double other = 1;

  /// The part that the restricted log likelihood adds, up to a constant.
  [[nodiscard]] double operator()(const FittedVariances& variances) const;
};

/// Of the model's columns about its noise. `share`: of the samples, those from which the noise is estimated, 0 to 1.
[[nodiscard]] NoiseRestriction noise_restriction(const Fitter&, const FitState&, double share);

}  // namespace kilotwin::identify

/// The variances that the fit of the noise estimates, as one vector.
#pragma once

#include <Eigen/Core>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

/// Their order: process noise first, then measurement noise.
namespace fitted_variance {
enum : Eigen::Index { kFactor, kWheel, kHeading, kDrift, kPosition, kMeasuredHeading, kCount };
}  // namespace fitted_variance

/// Units as in Noise.
using FittedVariances = Eigen::Matrix<double, fitted_variance::kCount, 1>;

[[nodiscard]] inline FittedVariances fitted_variances(const Noise& n) {
  FittedVariances v;
  v << n.factor_s, n.wheel_mm2_s, n.heading_rad2_s, n.drift_mm2_s, n.position_mm2, n.heading_rad2;
  return v;
}

/// The noise with other fitted variances. Contact noise stays.
[[nodiscard]] inline Noise with_fitted(Noise noise, const FittedVariances& v) {
  using namespace fitted_variance;
  noise.factor_s = v[kFactor];
  noise.wheel_mm2_s = v[kWheel];
  noise.heading_rad2_s = v[kHeading];
  noise.drift_mm2_s = v[kDrift];
  noise.position_mm2 = v[kPosition];
  noise.heading_rad2 = v[kMeasuredHeading];
  return noise;
}

}  // namespace kilotwin::identify

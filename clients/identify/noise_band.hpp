/// 95 % bands of effects on the noise.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "clients/identify/result/values.hpp"
#include "idl/effects.pb.h"

namespace kilotwin::identify {

/// The band of a factor of the noise's standard deviation, whose logarithm is linear in the coefficients: `at`, `value`, `low` and `high`
/// at each key of a table, or knot of a spline, and `axes` as of bands.hpp. `scale`: the function of given coefficients.
[[nodiscard]] JsonValue noise_band_of(const std::function<proto::Function(const Eigen::VectorXd&)>& scale,
                                      const Eigen::VectorXd& coefficients, const Eigen::MatrixXd& covariance);

}  // namespace kilotwin::identify

/// Terms as one function or as a matrix over two factors: parts that the fit of products, their separation and maps share.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Precision of the weak prior of an amplitude: a standard deviation of 10; a larger value pulls it towards 0.
inline constexpr double kAmplitudePrecision = 0.01;

/// Whether the first covariate of a factor is x or y: a curve along one of them, or a map.
[[nodiscard]] inline bool is_of_place(const Factor& f) {
  return f.axis.of == Covariate::kX || f.axis.of == Covariate::kY;
}

/// Multiplies a known function by a number.
inline void scale(Factor& f, double by) {
  f.plus *= by;
  for (double& k : f.known) k *= by;
}

/// The sum of the open parts of a term as one factor with known coefficients.
[[nodiscard]] std::optional<Factor> function_of(const Term&);

/// The coefficients of a term as a matrix over the columns of its two open factors.
struct FactorPair {
  Factor one, other;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> at;  ///< row and column of each coefficient
};

/// The blocks of a term that act on one target: two open factors each, of which the first continues the cosines of the block
/// before. Nothing: another term.
[[nodiscard]] std::optional<FactorPair> pair_of(const Term&);

}  // namespace kilotwin::identify

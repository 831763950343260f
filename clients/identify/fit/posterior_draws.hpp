/// Draws of models from the posterior of a fit, in Laplace's approximation: base parameters and coefficients jointly from their normal
/// distribution, then the biases of each robot given these. Noise, walls and the population of biases stay as fitted.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "clients/identify/fit/uncertainty.hpp"

namespace kilotwin::identify {

class PosteriorDraws {
 public:
  PosteriorDraws(MotionModel fitted, const Uncertainty& uncertainty);

  /// Draw `number` of a seed. Its values may lie outside the ranges of a model file.
  [[nodiscard]] MotionModel draw(std::uint32_t seed, std::uint32_t number) const;

 private:
  const MotionModel fitted_;
  const Eigen::MatrixXd
      root_;  ///< its product with its transpose is the covariance of base parameters and coefficients
  const std::map<std::uint32_t, GivenBiases> given_;
};

}  // namespace kilotwin::identify

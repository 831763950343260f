/// Forms of effects on the process noise: columns of the logarithm of its variance over a covariate.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "clients/identify/fit/noise_samples.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

struct NoiseForm {
  std::string name;
  std::vector<std::string> covariates;
  std::string in_words;            ///< on what the noise depends
  Eigen::MatrixXd columns;         ///< samples x columns; they span a constant
  std::vector<std::size_t> folds;  ///< of each sample; below kFolds
  /// The factor of the standard deviation as a function of the model file. `level`: the log variance that all samples share, beside
  /// the coefficients.
  std::function<proto::Function(const Eigen::VectorXd& coefficients, double level)> scale;

  /// Folds of the cross-validation. More leave more samples to learn from, and cost a fit each.
  static constexpr std::size_t kFolds = 6;
};

/// Stretch of a track whose samples may depend on each other.
[[nodiscard]] std::size_t stretch_of(const NoiseSample&);

/// All forms. Forms of one name are alternatives: over robots, over time, over the place, and several over neighbours.
[[nodiscard]] std::vector<NoiseForm> noise_forms(const std::vector<NoiseSample>&);

}  // namespace kilotwin::identify

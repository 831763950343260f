/// Effects on the process noise: its size may depend on the robot, on the place, on time, or on neighbours. They act on no mean, so the search
/// for terms cannot find them. Data: squared innovations after the search (fit/noise_samples.hpp).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "clients/identify/fit/noise_samples.hpp"
#include "clients/identify/noise_band.hpp"
#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::identify {

struct NoiseEffect {
  std::string name;
  std::vector<std::string> covariates;
  std::string depends_on;  ///< in words
  double log10_p = 0;      ///< of the score test
  double threshold_log10_p = 0;
  std::uint32_t degrees = 0;
  double gain = 0;                       ///< of the fit, nat, over its overdispersion
  double held_out = 0, held_out_se = 0;  ///< cross-validated log score, nat, and its standard error over stretches
  proto::Function scale;                 ///< factor of the noise's standard deviation
  double least = 1, most = 1;            ///< of that factor
  JsonValue band;                        ///< of that factor, 95 %
};

/// Effects in the order in which they were accepted: each passed a score test given those before it, and raises the cross-validated
/// log score. Folds are robots, or stretches of tracks if the effect belongs to robots.
[[nodiscard]] std::vector<NoiseEffect> find_noise_effects(const std::vector<NoiseSample>&);

/// Multiplies the process noise of a written model by the effects' scales.
void write_noise_effects(proto::Model&, const Noise& fitted, const std::vector<NoiseEffect>&);

[[nodiscard]] identification::Effect entry_of(const NoiseEffect&);

}  // namespace kilotwin::identify

/// The random part of a motion model, as noise of a filter.
#pragma once

#include <vector>

#include "core/effects/robots.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::monitor {

/// The noise of an effect, white over the filter's time scale.
struct NoiseTerm {
  EffectSettings::Target target;
  bool left = true, right = true;     ///< for effects on wheels
  std::uint8_t commands = 0;          ///< bits of the MotionCommands during which it acts; 0: while driven
  double variance_per_s = 0;          ///< of the target's integral over time
  std::vector<std::uint32_t> robots;  ///< ascending; empty: all
};

/// Contribution of slowly varying noise of the effects to the biases: variance, and its growth per second.
struct BiasNoise {
  double variance_mm2_s2 = 0, growth_mm2_s3 = 0;
};

/// Noise with a correlation time of up to 5 s counts as white; slower noise as a random walk of the biases.
[[nodiscard]] std::vector<NoiseTerm> noise_terms(const RunPlan& plan);
[[nodiscard]] BiasNoise bias_noise(const RunPlan& plan);

/// The plan without noise, and without the effects that have noise or episodes.
[[nodiscard]] RunPlan without_noise(const RunPlan& plan);

}  // namespace kilotwin::monitor

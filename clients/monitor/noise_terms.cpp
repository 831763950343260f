#include "clients/monitor/noise_terms.hpp"

#include <algorithm>

#include "core/effects/function.hpp"
#include "core/plan/motion_settings.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::monitor {
namespace {

constexpr double kSlow_s = 5;
/// Range of a covariate over which the factors of a noise are bounded: of time, place and robot that of the run, else a usual one.
Range range_of(Covariate covariate, const RunPlan& plan) {
  const double x_mm = plan.world.arena.stated_width_mm() / 2, y_mm = plan.world.arena.stated_height_mm() / 2;
  switch (covariate) {
    case Covariate::kTime: return {0, plan.duration_s};
    case Covariate::kX: return {-x_mm, x_mm};
    case Covariate::kY: return {-y_mm, y_mm};
    case Covariate::kRobot: return {0, static_cast<double>(plan.robots())};
    default: return {0, 60};
  }
}

bool is_random(const proto::Effect& effect) {
  return std::any_of(effect.function().begin(), effect.function().end(), [](const proto::Function& function) {
    return function.has_noise() || function.has_episodes();
  });
}

struct Amplitude {
  const NoiseShape* noise = nullptr;  ///< null: the effect has none
  double variance = 0;
};

Amplitude amplitude_of(const EffectSettings& effect, const RunPlan& plan) {
  Amplitude found;
  double factor = 1;
  for (const FunctionSettings& function : effect.functions) {
    if (function.episodes() != nullptr) return {};
    if (function.noise() != nullptr)
      found.noise = function.noise();
    else
      factor *= EffectFunction(function).largest(range_of(function.of, plan), range_of(function.and_of, plan));
  }
  if (found.noise != nullptr) found.variance = found.noise->sd * found.noise->sd * factor * factor;
  return found;
}

}  // namespace

std::vector<NoiseTerm> noise_terms(const RunPlan& plan) {
  std::vector<NoiseTerm> terms;
  for (const EffectSettings& effect : plan.effects()) {
    const Amplitude amplitude = amplitude_of(effect, plan);
    if (amplitude.noise == nullptr || amplitude.noise->correlation_s > kSlow_s || effect.is_measured()) continue;
    NoiseTerm term{effect.target, true, true, 0, amplitude.variance, effect.robots};
    term.left = effect.wheel != EffectSettings::Wheel::kRightWheel;
    term.right = effect.wheel != EffectSettings::Wheel::kLeftWheel;
    for (const MotionCommand command : effect.during)
      term.commands = static_cast<std::uint8_t>(term.commands | bit_of(command));
    if (amplitude.noise->correlation_s > 0) term.variance_per_s *= 2 * amplitude.noise->correlation_s;
    std::sort(term.robots.begin(), term.robots.end());
    terms.push_back(std::move(term));
  }
  return terms;
}

BiasNoise bias_noise(const RunPlan& plan) {
  const MotionSettings& motion = plan.motion_settings();
  BiasNoise sum;
  for (const EffectSettings& effect : plan.effects()) {
    const Amplitude amplitude = amplitude_of(effect, plan);
    if (amplitude.noise == nullptr || amplitude.noise->correlation_s <= kSlow_s || effect.is_measured()) continue;
    double scale = 1;  // of a wheel's speed over the target
    if (effect.target == EffectSettings::Target::kTurnRate) scale = motion.wheel_base_mm / 2;
    if (effect.target == EffectSettings::Target::kWheelGain)
      scale = std::max(motion.straight_speed_mm_s, motion.turn_speed_mm_s);
    sum.variance_mm2_s2 += scale * scale * amplitude.variance;
    sum.growth_mm2_s3 += 2 * scale * scale * amplitude.variance / amplitude.noise->correlation_s;
  }
  return sum;
}

RunPlan without_noise(const RunPlan& plan) {
  proto::Manifest manifest = plan.manifest();
  proto::Experiment& experiment = *manifest.mutable_experiment();
  experiment.mutable_motion()->set_noise(false);
  auto& effects = *experiment.mutable_effect();
  effects.erase(std::remove_if(effects.begin(), effects.end(), is_random), effects.end());
  return RunPlan(std::move(manifest));
}

}  // namespace kilotwin::monitor

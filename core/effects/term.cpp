#include "core/effects/term.hpp"

#include <algorithm>

#include "core/math/elementary.h"

namespace kilotwin {

namespace {

using Wheel = EffectSettings::Wheel;

constexpr std::uint8_t kDriven =
    bit_of(MotionCommand::kStraight) | bit_of(MotionCommand::kTurnLeft) | bit_of(MotionCommand::kTurnRight);
constexpr std::uint8_t kAlways = kDriven | bit_of(MotionCommand::kStop);

/// Draws per effect: 2 per function, one for each wheel.
constexpr std::uint32_t kDrawsPerEffect = 16;

}  // namespace

TermList::TermList(const RunPlan& plan, Of of)
    : plan_(plan),
      of_(of),
      random_(plan.seed()),
      noise_per_tick_(of == Of::kMotion ? __builtin_sqrt(1 / plan.tick_length.seconds()) : 1),
      covariates_(plan) {
  for (std::uint32_t number = 0; number < plan.effects().size(); ++number) {
    const EffectSettings& effect = plan.effects()[number];
    if (effect.is_measured() != (of == Of::kMeasured)) continue;
    const bool left = effect.wheel != Wheel::kRightWheel, right = effect.wheel != Wheel::kLeftWheel;
    if (left && right && effect.is_per_wheel()) {
      add(effect, number, true, false, 0);
      add(effect, number, false, true, 1);
    } else {
      add(effect, number, left, right, left ? 0 : 1);
    }
  }
}

void TermList::add(const EffectSettings& effect, std::uint32_t number, bool left, bool right, std::uint32_t wheel) {
  Term term{};
  term.target = effect.target;
  term.left = left;
  term.right = right;
  const double direction_deg = effect.direction_deg;
  if (direction_deg != 0) kt_sincos(direction_deg * (kPi / 180), &term.across, &term.along);
  term.commands = of_ == Of::kMeasured ? kAlways : kDriven;
  if (!effect.during.empty()) term.commands = 0;
  for (const MotionCommand command : effect.during)
    term.commands = static_cast<std::uint8_t>(term.commands | bit_of(command));
  if (!effect.robots.empty()) {
    term.applies.assign(plan_.robots(), 0);
    for (const std::uint32_t robot : effect.robots) {
      if (robot < plan_.robots()) term.applies[robot] = 1;
    }
  }
  if (!effect.sum.empty()) {
    const auto known = std::find(sum_names_.begin(), sum_names_.end(), effect.sum);
    term.sum = static_cast<std::uint32_t>(known - sum_names_.begin());
    if (known == sum_names_.end()) sum_names_.push_back(effect.sum);
  }
  for (std::uint32_t f = 0; f < effect.functions.size(); ++f) {
    const FunctionSettings& given = effect.functions[f];
    Term::Factor factor{
        EffectFunction(given), 0, 0, false, false, given.noise() != nullptr, given.episodes() != nullptr,
        std::nullopt,          0};
    const auto column = [&](Covariate of, std::uint32_t& index) {
      if (of == Covariate::kNothing) return false;
      index = covariates_.need(of_wheel(of, wheel), given);
      return true;
    };
    factor.has_first = column(given.of, factor.first);
    factor.has_second = column(given.and_of, factor.second);
    factor.draw = number * kDrawsPerEffect + 2 * f + wheel;
    if (factor.is_noise && given.noise()->correlation_s > 0) {
      const std::uint32_t slot_wheel = effect.wheel == Wheel::kBoth ? wheel : 0;
      factor.slot = plan_.memory.index_of({MemorySlot::Kind::kNoise, 0, number, f, slot_wheel});
    }
    if (factor.is_episodes) factor.slot = plan_.memory.index_of({MemorySlot::Kind::kEpisode, 0, number, f});
    term.factors.push_back(std::move(factor));
  }
  terms_.push_back(std::move(term));
}

double TermList::largest(const Term& term) const {
  double product = 1;
  for (const Term::Factor& factor : term.factors) {
    const Range first = factor.has_first ? covariates_.range(factor.first) : Range{0, 0};
    const Range second = factor.has_second ? covariates_.range(factor.second) : Range{0, 0};
    product *= factor.function.largest(first, second);
    if (factor.is_noise) product *= kTopNormal * (factor.slot ? 1 : noise_per_tick_);
  }
  return product;
}

void TermList::compute(const Term& term, Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who) {
  values_.assign(who.size(), 1);
  for (const Term::Factor& factor : term.factors) {
    factor.function.multiply(factor.has_first ? covariates_.values(factor.first) : std::span<const double>{},
                             factor.has_second ? covariates_.values(factor.second) : std::span<const double>{},
                             values_);
    if (factor.is_episodes) {
      const std::size_t stride = plan_.memory.size();
      for (std::size_t i = 0; i < who.size(); ++i)
        values_[i] = robots.memory[who[i] * stride + *factor.slot] < 0 ? values_[i] : 0.0;
    }
    if (!factor.is_noise) continue;
    if (factor.slot) {
      const std::size_t stride = plan_.memory.size();
      for (std::size_t i = 0; i < who.size(); ++i) values_[i] *= robots.memory[who[i] * stride + *factor.slot];
    } else {
      const Stream stream = of_ == Of::kMotion ? Stream::kEffectNoise : Stream::kMeasurementNoise;
      for (std::size_t i = 0; i < who.size(); ++i)
        values_[i] *= noise_per_tick_ * random_.normal(stream, robots.robot[who[i]], now, factor.draw);
    }
  }
  const std::span<const std::uint8_t> commands = covariates_.command_bits();
  for (std::size_t i = 0; i < who.size(); ++i) values_[i] = (commands[i] & term.commands) != 0 ? values_[i] : 0.0;
  if (term.applies.empty()) return;
  for (std::size_t i = 0; i < who.size(); ++i)
    values_[i] = term.applies[robots.robot[who[i]]] != 0 ? values_[i] : 0.0;
}

}  // namespace kilotwin

#include "core/effects/term.hpp"

#include "core/math/elementary.h"

namespace kilotwin {

using proto::Effect, proto::Function;

namespace {

constexpr std::uint8_t kDriven = 1u << proto::STRAIGHT | 1u << proto::LEFT | 1u << proto::RIGHT;
constexpr std::uint8_t kAlways = kDriven | 1u << proto::STOP;

/// Draws of one effect: 2 per function, for the wheels.
constexpr std::uint32_t kDrawsPerEffect = 16;

}  // namespace

TermList::TermList(const RunPlan& plan, Of of)
    : plan_(plan),
      of_(of),
      random_(plan.seed()),
      noise_per_tick_(of == Of::kMotion ? __builtin_sqrt(1 / plan.tick_length.seconds()) : 1),
      covariates_(plan) {
  const proto::Experiment& experiment = plan.experiment();
  for (int i = 0; i < experiment.effect_size(); ++i) {
    const Effect& effect = experiment.effect(i);
    if (is_measured(effect.acts_on()) != (of == Of::kMeasured)) continue;
    const auto number = static_cast<std::uint32_t>(i);
    const bool left = effect.wheel() != Effect::RIGHT_WHEEL, right = effect.wheel() != Effect::LEFT_WHEEL;
    if (left && right && is_per_wheel(effect)) {
      add(effect, number, true, false, 0);
      add(effect, number, false, true, 1);
    } else {
      add(effect, number, left, right, left ? 0 : 1);
    }
  }
}

void TermList::add(const Effect& effect, std::uint32_t number, bool left, bool right, std::uint32_t wheel) {
  Term term{};
  term.target = effect.acts_on();
  term.left = left;
  term.right = right;
  const double direction_deg = effect.direction_deg();
  if (direction_deg != 0) kt_sincos(direction_deg * (kPi / 180), &term.across, &term.along);
  term.commands = of_ == Of::kMeasured ? kAlways : kDriven;
  if (effect.during_size() > 0) term.commands = 0;
  for (const int command : effect.during())
    term.commands = static_cast<std::uint8_t>(term.commands | 1u << command);
  if (effect.robot_size() > 0) {
    term.applies.assign(plan_.robots(), 0);
    for (const std::uint32_t robot : effect.robot()) {
      if (robot < plan_.robots()) term.applies[robot] = 1;
    }
  }
  for (int f = 0; f < effect.function_size(); ++f) {
    const Function& given = effect.function(f);
    Term::Factor factor{EffectFunction(given), 0, 0, false, false, given.has_noise(), given.has_episodes(),
                        std::nullopt,          0};
    const auto column = [&](Function::Covariate of, std::uint32_t& index) {
      if (of == Function::NOTHING) return false;
      index = covariates_.need(of_wheel(of, wheel), given);
      return true;
    };
    factor.has_first = column(given.of(), factor.first);
    factor.has_second = column(given.and_of(), factor.second);
    const auto at = static_cast<std::uint32_t>(f);
    factor.draw = number * kDrawsPerEffect + 2 * at + wheel;
    if (factor.is_noise && given.noise().correlation_s() > 0) {
      const std::uint32_t slot_wheel = effect.wheel() == Effect::BOTH_WHEELS ? wheel : 0;
      factor.slot = plan_.memory.index_of({MemorySlot::Kind::kNoise, 0, number, at, slot_wheel});
    }
    if (factor.is_episodes) factor.slot = plan_.memory.index_of({MemorySlot::Kind::kEpisode, 0, number, at});
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

#include "core/effects/motion_effects.hpp"

#include <algorithm>

#include "core/plan/motion_settings.hpp"

namespace kilotwin {

using Target = EffectSettings::Target;

namespace {

double magnitude(double v) { return v < 0 ? -v : v; }

}  // namespace

MotionEffects::MotionEffects(const RunPlan& plan)
    : terms_(plan, TermList::Of::kMotion),
      sums_(terms_.sums()),
      half_base_mm_(plan.motion_settings().wheel_base_mm / 2),
      limit_mm_s_(plan.motion_settings().effects_limit_mm_s) {
  for (const Term& term : terms_.terms()) {
    act_at_rest_ = act_at_rest_ || (term.commands & bit_of(MotionCommand::kStop)) != 0;
    drift_ = drift_ || term.target == Target::kWorldDrift || term.target == Target::kBodyDrift;
  }
}

MotionEffects::Limits MotionEffects::limits(double top_wheel_mm_s) const {
  double gain = 1;
  std::vector<double> sums(terms_.sums(), 0);
  Limits limits;
  for (const Term& term : terms_.terms()) {
    const double largest = terms_.largest(term);
    switch (term.target) {
      case Target::kWheelGain:
        if (term.sum)
          sums[*term.sum] += largest;
        else
          gain *= 1 + largest;
        break;
      case Target::kWheelOffset: limits.wheel_mm_s += largest; break;
      case Target::kTurnRate: limits.wheel_mm_s += largest * half_base_mm_; break;
      case Target::kBodyDrift:
        limits.wheel_mm_s += largest * magnitude(term.along);
        limits.sideways_mm_s += largest * magnitude(term.across);
        break;
      case Target::kWorldDrift:
        limits.drift_mm_s += largest * std::max(magnitude(term.along), magnitude(term.across));
        break;
      default: break;
    }
  }
  for (const double sum : sums) gain *= 1 + sum;
  limits.wheel_mm_s += (gain - 1) * top_wheel_mm_s;
  // TermList::largest() may be slightly too small, so the limits get a reserve.
  constexpr double kRoom = 1.05;
  for (double* const limit : {&limits.wheel_mm_s, &limits.sideways_mm_s, &limits.drift_mm_s})
    *limit = std::min(*limit * kRoom, limit_mm_s_);
  return limits;
}

void MotionEffects::evaluate(Tick from, const RobotColumns& robots, std::span<const std::uint32_t> who,
                             const ArenaFields* fields, MotionChanges& changes) {
  const std::size_t count = who.size();
  for (auto* const ones : {&changes.left_gain, &changes.right_gain}) ones->assign(count, 1);
  for (auto* const zeros : {&changes.left_mm_s, &changes.right_mm_s, &changes.sideways_mm_s, &changes.drift_x_mm_s,
                            &changes.drift_y_mm_s}) {
    zeros->assign(count, 0);
  }
  for (GainSum& sum : sums_) {
    sum.left.assign(count, 0);
    sum.right.assign(count, 0);
  }
  const auto add = [count](std::vector<double>& to, std::span<const double> values, double factor) {
    for (std::size_t i = 0; i < count; ++i) to[i] += factor * values[i];
  };
  terms_.evaluate(from, robots, who, fields, [&](const Term& term, std::span<const double> values) {
    switch (term.target) {
      case Target::kWheelGain:
        if (term.sum) {
          if (term.left) add(sums_[*term.sum].left, values, 1);
          if (term.right) add(sums_[*term.sum].right, values, 1);
          break;
        }
        for (std::size_t i = 0; i < count; ++i) {
          if (term.left) changes.left_gain[i] *= 1 + values[i];
          if (term.right) changes.right_gain[i] *= 1 + values[i];
        }
        break;
      case Target::kWheelOffset:
        if (term.left) add(changes.left_mm_s, values, 1);
        if (term.right) add(changes.right_mm_s, values, 1);
        break;
      case Target::kTurnRate:
        add(changes.left_mm_s, values, -half_base_mm_);
        add(changes.right_mm_s, values, half_base_mm_);
        break;
      case Target::kBodyDrift:
        add(changes.left_mm_s, values, term.along);
        add(changes.right_mm_s, values, term.along);
        add(changes.sideways_mm_s, values, term.across);
        break;
      case Target::kWorldDrift:
        add(changes.drift_x_mm_s, values, term.along);
        add(changes.drift_y_mm_s, values, term.across);
        break;
      default: break;
    }
  });
  for (const GainSum& sum : sums_) {
    for (std::size_t i = 0; i < count; ++i) changes.left_gain[i] *= 1 + sum.left[i];
    for (std::size_t i = 0; i < count; ++i) changes.right_gain[i] *= 1 + sum.right[i];
  }
}

}  // namespace kilotwin

#include "core/effects/motion_effects.hpp"

#include <algorithm>

#include "core/effects/motion_change.hpp"
#include "core/plan/motion_settings.hpp"

namespace kilotwin {

using Target = EffectSettings::Target;

namespace {

UnitOffsets offsets_of(const Term& term, double half_base_mm) {
  return unit_offsets(term.target, term.left, term.right, term.along, term.across, 2 * half_base_mm);
}

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
    if (term.target == Target::kWheelGain) {
      if (term.sum)
        sums[*term.sum] += largest;
      else
        gain *= 1 + largest;
      continue;
    }
    const UnitOffsets unit = offsets_of(term, half_base_mm_);
    limits.wheel_mm_s += largest * std::max(magnitude(unit.left), magnitude(unit.right));
    limits.sideways_mm_s += largest * magnitude(unit.sideways);
    limits.drift_mm_s += largest * std::max(magnitude(unit.drift_x), magnitude(unit.drift_y));
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
    if (factor == 0) return;
    for (std::size_t i = 0; i < count; ++i) to[i] += factor * values[i];
  };
  const auto multiply = [count](std::vector<double>& gain, std::span<const double> values) {
    for (std::size_t i = 0; i < count; ++i) gain[i] *= 1 + values[i];
  };
  terms_.evaluate(from, robots, who, fields, [&](const Term& term, std::span<const double> values) {
    if (term.target == Target::kWheelGain) {
      if (term.sum) {
        if (term.left) add(sums_[*term.sum].left, values, 1);
        if (term.right) add(sums_[*term.sum].right, values, 1);
      } else {
        if (term.left) multiply(changes.left_gain, values);
        if (term.right) multiply(changes.right_gain, values);
      }
      return;
    }
    const UnitOffsets unit = offsets_of(term, half_base_mm_);
    add(changes.left_mm_s, values, unit.left);
    add(changes.right_mm_s, values, unit.right);
    add(changes.sideways_mm_s, values, unit.sideways);
    add(changes.drift_x_mm_s, values, unit.drift_x);
    add(changes.drift_y_mm_s, values, unit.drift_y);
  });
  for (const GainSum& sum : sums_) {
    multiply(changes.left_gain, sum.left);
    multiply(changes.right_gain, sum.right);
  }
}

}  // namespace kilotwin

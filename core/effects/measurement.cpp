#include "core/effects/measurement.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/math/elementary.h"

namespace kilotwin {

using Target = EffectSettings::Target;

Measurement::Measurement(const RunPlan& plan) : plan_(plan), motors_(plan), terms_(plan, TermList::Of::kMeasured) {
  if (!any()) return;
  const std::size_t robots = plan.robots();
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    robot_.push_back(robot);
    tracked_.push_back(plan.tracked(robot));
    if (!plan.tracked(robot)) who_.push_back(robot);
  }
  duties_.resize(robots);
}

void Measurement::measure(const SwarmView& swarm, MeasuredPoses& seen) {
  KILOTWIN_DEMAND(any());
  for (const std::uint32_t robot : who_)
    duties_[robot] = motors_.acting(swarm.motor_left[robot], swarm.motor_right[robot], swarm.spin_up[robot]);
  const std::size_t count = who_.size();
  for (auto* const zeros : {&ahead_mm_, &left_mm_, &offset_x_mm_, &offset_y_mm_, &turn_rad_})
    zeros->assign(count, 0);
  scale_.assign(count, 1);
  const auto add = [count](std::vector<double>& to, std::span<const double> values, double factor) {
    for (std::size_t i = 0; i < count; ++i) to[i] += factor * values[i];
  };
  const RobotColumns robots{robot_, swarm.x_mm, swarm.y_mm, swarm.heading_rad, swarm.memory, duties_, tracked_};
  terms_.evaluate(swarm.tick, robots, who_, nullptr, [&](const Term& term, std::span<const double> values) {
    switch (term.target) {
      case Target::kMeasuredOffset:
        add(offset_x_mm_, values, term.along);
        add(offset_y_mm_, values, term.across);
        break;
      case Target::kMeasuredBodyOffset:
        add(ahead_mm_, values, term.along);
        add(left_mm_, values, term.across);
        break;
      case Target::kMeasuredScale:
        for (std::size_t i = 0; i < count; ++i) scale_[i] *= 1 + values[i];
        break;
      case Target::kMeasuredHeading: add(turn_rad_, values, 1); break;
      default: break;
    }
  });
  seen.x_mm = swarm.x_mm;
  seen.y_mm = swarm.y_mm;
  seen.heading_rad = swarm.heading_rad;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t robot = who_[i];
    double s, c;
    kt_sincos(swarm.heading_rad[robot], &s, &c);
    seen.x_mm[robot] = (swarm.x_mm[robot] + (c * ahead_mm_[i] - s * left_mm_[i])) * scale_[i] + offset_x_mm_[i];
    seen.y_mm[robot] = (swarm.y_mm[robot] + (s * ahead_mm_[i] + c * left_mm_[i])) * scale_[i] + offset_y_mm_[i];
    constexpr double kMostTurns_rad = 100;
    seen.heading_rad[robot] =
        wrapped(swarm.heading_rad[robot] + std::clamp(turn_rad_[i], -kMostTurns_rad, kMostTurns_rad));
  }
}

}  // namespace kilotwin

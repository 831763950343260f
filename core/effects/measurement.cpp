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
  for (auto* const column : {&x_mm_, &y_mm_, &heading_rad_}) column->resize(robots);
  memory_.resize(robots * plan.memory.size());
  duties_.resize(robots);
}

void Measurement::gather(std::span<const BodyFrame* const> bodies,
                         std::span<const ActuationFrame* const> actuation) {
  const std::size_t stride = plan_.memory.size();
  for (const BodyFrame* frame : bodies) {
    for (std::size_t i = 0; i < frame->robot.size(); ++i) {
      const std::uint32_t robot = frame->robot[i];
      x_mm_[robot] = frame->x_mm[i];
      y_mm_[robot] = frame->y_mm[i];
      heading_rad_[robot] = frame->heading_rad[i];
      for (std::size_t s = 0; s < stride; ++s) memory_[robot * stride + s] = frame->memory[i * stride + s];
    }
  }
  for (const ActuationFrame* frame : actuation) {
    for (std::size_t i = 0; i < frame->motor_left.size(); ++i) {
      const std::size_t robot = frame->first_robot + i;
      if (tracked_[robot] == 0)
        duties_[robot] = motors_.acting(frame->motor_left[i], frame->motor_right[i], frame->spin_up[i]);
    }
  }
}

void Measurement::measure(Tick now, std::span<const BodyFrame* const> bodies,
                          std::span<const ActuationFrame* const> actuation, MeasuredPoses& seen) {
  KILOTWIN_DEMAND(any());
  gather(bodies, actuation);
  const std::size_t count = who_.size();
  for (auto* const zeros : {&ahead_mm_, &left_mm_, &offset_x_mm_, &offset_y_mm_, &turn_rad_})
    zeros->assign(count, 0);
  scale_.assign(count, 1);
  const auto add = [count](std::vector<double>& to, std::span<const double> values, double factor) {
    for (std::size_t i = 0; i < count; ++i) to[i] += factor * values[i];
  };
  const RobotColumns robots{robot_, x_mm_, y_mm_, heading_rad_, memory_, duties_, tracked_};
  terms_.evaluate(now, robots, who_, nullptr, [&](const Term& term, std::span<const double> values) {
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
  seen.x_mm = x_mm_;
  seen.y_mm = y_mm_;
  seen.heading_rad = heading_rad_;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t robot = who_[i];
    double s, c;
    kt_sincos(heading_rad_[robot], &s, &c);
    seen.x_mm[robot] = (x_mm_[robot] + (c * ahead_mm_[i] - s * left_mm_[i])) * scale_[i] + offset_x_mm_[i];
    seen.y_mm[robot] = (y_mm_[robot] + (s * ahead_mm_[i] + c * left_mm_[i])) * scale_[i] + offset_y_mm_[i];
    constexpr double kMostTurns_rad = 100;
    seen.heading_rad[robot] =
        wrapped(heading_rad_[robot] + std::clamp(turn_rad_[i], -kMostTurns_rad, kMostTurns_rad));
  }
}

}  // namespace kilotwin

#include "core/effects/robots.hpp"

#include <algorithm>

#include "core/plan/motion_settings.hpp"

namespace kilotwin {

MotorRule::MotorRule(const RunPlan& plan)
    : dead_band_duty_(static_cast<std::uint8_t>(std::min(plan.motion_settings().dead_band_duty, 254u))),
      kick_part_(std::min(1.0, plan.motion_settings().spin_up_s / plan.tick_length.seconds())) {}

}  // namespace kilotwin

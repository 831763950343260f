#include "services/physics/contact_limits.hpp"

#include <algorithm>

#include "core/plan/physics_settings.hpp"

namespace kilotwin::physics {

ContactLimits::ContactLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.physics_settings().sub_steps, 1u, 4u)) {
  const double steps = sub_steps;
  const double sub_step_s = plan.tick_length.seconds() / steps;
  separation_mm = kSeparation_mm_s * sub_step_s;
  stride_mm = std::max(separation_mm, drive.top_speed_mm_s() * sub_step_s);
  // Two bodies close by at most 2 strides in a sub-step.
  cutoff_mm = kDiameter_mm + 2 * steps * stride_mm;
  // One cutoff per sub-step (hop), plus the distance by which a body can leave the rectangle in this tick.
  margin_mm = steps * cutoff_mm + steps * stride_mm;
  x_limit_mm = plan.world.arena.half_width_mm() - kRobotRadius_mm;
  y_limit_mm = plan.world.arena.half_height_mm() - kRobotRadius_mm;
  touch_mm = 2 * stride_mm;
  const PhysicsSettings& physics = plan.physics_settings();
  // Velocity change per sub-step, mm, of a body of true mass per m/s^2.
  const double mm_per_m_s2 = 1000 * sub_step_s * sub_step_s / kInertia;
  thrust_mm = physics.thrust_N / (physics.robot_mass_g / 1000) * mm_per_m_s2;
  rim_friction = physics.rim_friction;
  hold_mm = physics.robot_friction * kGravity_m_s2 * mm_per_m_s2;
}

}  // namespace kilotwin::physics

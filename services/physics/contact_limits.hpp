/// Constants of planar contact for one run. contact.hpp states the method.
#pragma once

#include <cstdint>

#include "core/base/pose.hpp"
#include "core/plan/plan.hpp"
#include "services/physics/contact_batch.hpp"
#include "services/physics/contact_constants.hpp"
#include "services/physics/drive.hpp"

namespace kilotwin::physics {

/// Largest speed of each of two overlapping bodies as they separate, mm/s: the speed of a wheel at the calibrated turn.
inline constexpr double kSeparation_mm_s = 20;

/// Constants of a run.
struct ContactLimits {
  ContactLimits(const RunPlan&, const DriveModel&);

  std::uint32_t sub_steps;
  double separation_mm;  ///< largest displacement of an overlapping body per sub-step
  double stride_mm;      ///< largest displacement of any body in a sub-step
  double cutoff_mm;      ///< farther centres at the tick's start: no contact within the tick
  double margin_mm;  ///< distance from a partition's rectangle within which bodies can affect own ones in a tick
  double x_limit_mm, y_limit_mm;  ///< the centre of a disc stays within +-limit
  double
      touch_mm;  ///< a contact carries impulse up to this gap; a robot that follows another at full speed keeps it
  double rim_friction;        ///< between two robots
  double thrust_mm, hold_mm;  ///< grip of a driven and of a resting robot, in the unit of contact_state.hpp

  [[nodiscard]] bool outside(double x_mm, double y_mm) const {
    return x_mm > x_limit_mm || x_mm < -x_limit_mm || y_mm > y_limit_mm || y_mm < -y_limit_mm;
  }
  /// Whether the body could reach a wall within the tick plus `more_mm`.
  [[nodiscard]] bool near_wall(double x_mm, double y_mm, double more_mm) const {
    const double way_mm = sub_steps * stride_mm + more_mm;
    return x_mm > x_limit_mm - way_mm || x_mm < way_mm - x_limit_mm || y_mm > y_limit_mm - way_mm ||
           y_mm < way_mm - y_limit_mm;
  }
  [[nodiscard]] PassLimits of_pass() const {
    return {{hold_mm, thrust_mm},
            separation_mm,
            stride_mm,
            touch_mm,
            x_limit_mm,
            y_limit_mm,
            rim_friction,
            cutoff_mm * cutoff_mm,
            kRobotRadius_mm / sub_steps,
            sub_steps};
  }
};

}  // namespace kilotwin::physics

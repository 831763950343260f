/// Motion that the current model predicts for a robot under its command, without its own bias.
#pragma once

#include "core/effects/motion_change.hpp"

namespace kilotwin::monitor {

/// Constant over one tick, or the mean over several. The bias of a wheel acts while the robot is driven.
struct WheelMotion {
  double nominal_left_mm_s = 0, nominal_right_mm_s = 0;
  double gain_left = 1, gain_right = 1;
  double offset_left_mm_s = 0, offset_right_mm_s = 0;
  double sideways_mm_s = 0;                   ///< to the left of the heading
  double drift_x_mm_s = 0, drift_y_mm_s = 0;  ///< in the arena
  double limit_mm_s = 0;                      ///< of the effects on a wheel's speed
  double driven = 0;                          ///< fraction of the time with a motor on
  // Variance of the noise per second: of the distance of a wheel, relative to its squared speed, s, and apart from it, mm^2/s; of
  // the heading, rad^2/s; of the position, mm^2/s.
  double relative_noise_left = 0, relative_noise_right = 0;
  double noise_left = 0, noise_right = 0, noise_turn = 0, noise_position = 0;
  /// Change of the wheels' speeds against the tick before, mm/s.
  double change_left_mm_s = 0, change_right_mm_s = 0;

  /// Speeds of the wheels with a bias, mm/s.
  [[nodiscard]] double left_mm_s(double bias_mm_s) const {
    return changed_speed(nominal_left_mm_s + driven * bias_mm_s, gain_left, offset_left_mm_s, limit_mm_s);
  }
  [[nodiscard]] double right_mm_s(double bias_mm_s) const {
    return changed_speed(nominal_right_mm_s + driven * bias_mm_s, gain_right, offset_right_mm_s, limit_mm_s);
  }
};

}  // namespace kilotwin::monitor

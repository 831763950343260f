/// Poses in the arena frame W: origin at the arena's centre, x right, y up, heading from x anticlockwise.
#pragma once

namespace kilotwin {

inline constexpr double kPi = 3.14159265358979323846;
/// Radius of a Kilobot's disc, mm (diameter 33 mm: the ARGoS paper, Pinciroli 2018, section 2.1).
inline constexpr double kRobotRadius_mm = 16.5;

/// p_WR: pose of a robot's disc R in the arena W.
struct Pose {
  double x_mm = 0, y_mm = 0;
  double heading_rad = 0;  ///< in [-pi, pi)
};

/// The equivalent angle in [-pi, pi), for |angle| up to a few turns.
[[nodiscard]] inline double wrapped(double angle_rad) {
  while (angle_rad >= kPi) angle_rad -= 2 * kPi;
  while (angle_rad < -kPi) angle_rad += 2 * kPi;
  return angle_rad;
}

}  // namespace kilotwin

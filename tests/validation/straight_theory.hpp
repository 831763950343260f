/// Closed form of the mean square displacement of robots that drive straight, each with constant biases of its wheels.
///
/// Wheels that are B apart have the speeds v0 + b_left and v0 + b_right, with independent b ~ N(mean, sd). The speed of the
/// reference point v = v0 + (b_left + b_right) / 2 and the turn rate w = (b_right - b_left) / B are independent:
///   v ~ N(v0 + mean, sd^2 / 2),   w ~ N(0, s^2), s = sqrt(2) sd / B.
/// The reference point runs on an arc, and the disc's centre lies the axle offset a ahead of it. In the complex plane, from a
/// heading along the real axis,
///   reference point (e^(i w t) - 1) v / (i w),   centre (e^(i w t) - 1) (v / (i w) + a),
/// so the squared displacement of the centre is 2 (1 - cos w t) (v^2 / w^2 + a^2). Its mean, with
/// 2 (1 - cos w t) / w^2 = double integral of cos(w (u - u')) over 0..t, and E cos(w x) = exp(-s^2 x^2 / 2), is
///   E[v^2] G(t) + 2 a^2 (1 - exp(-s^2 t^2 / 2)),
///   G(t) = 2 (t sqrt(pi / 2) / s erf(s t / sqrt(2)) - (1 - exp(-s^2 t^2 / 2)) / s^2),   E[v^2] = (v0 + mean)^2 + sd^2 / 2.
#pragma once

#include <vector>

namespace kilotwin::validation {

struct StraightTheory {
  double speed_mm_s = 10, bias_mean_mm_s = 0.015, bias_sd_mm_s = 1.86, wheel_base_mm = 25, axle_offset_mm = 9.2;

  /// Mean square displacement of the disc's centre, mm^2, `time_s` after it began to move.
  [[nodiscard]] double msd_mm2(double time_s) const;
};

struct Track {
  std::vector<double> time_s, x_mm, y_mm, heading_rad;  ///< of the disc's centre
};

struct WheelBias {
  double left_mm_s, right_mm_s;
};

/// The estimator of the ARGoS paper (section 2.2): the displacement over each `interval_s` is a chord; its arc, by the turn of the
/// heading, gives speed and turn rate, the differential drive both wheels' speeds, and these less the nominal speed the
/// biases; their mean over the intervals is returned. The heading must be known often enough to be unwrapped.
[[nodiscard]] WheelBias estimate_bias(const Track&, const StraightTheory&, double interval_s, int intervals);

}  // namespace kilotwin::validation

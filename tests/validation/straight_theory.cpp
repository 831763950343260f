#include "tests/validation/straight_theory.hpp"

#include <cmath>
#include <cstddef>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::validation {
namespace {

/// The first entry at `time_s` or later, by rounding.
std::size_t index_at(const Track& track, double time_s) {
  for (std::size_t k = 0; k < track.time_s.size(); ++k) {
    if (track.time_s[k] >= time_s - 1e-9) return k;
  }
  KILOTWIN_DEMAND(!"the track ends before that time");
  return 0;
}

}  // namespace

double StraightTheory::msd_mm2(double time_s) const {
  const double square_speed =
      (speed_mm_s + bias_mean_mm_s) * (speed_mm_s + bias_mean_mm_s) + 0.5 * bias_sd_mm_s * bias_sd_mm_s;
  if (bias_sd_mm_s == 0) return square_speed * time_s * time_s;
  const double s = std::sqrt(2.0) * bias_sd_mm_s / wheel_base_mm;
  const double decayed = -std::expm1(-0.5 * s * s * time_s * time_s);
  const double g =
      2 * (time_s * std::sqrt(0.5 * kPi) / s * std::erf(s * time_s / std::sqrt(2.0)) - decayed / (s * s));
  return square_speed * g + 2 * axle_offset_mm * axle_offset_mm * decayed;
}

WheelBias estimate_bias(const Track& track, const StraightTheory& nominal, double interval_s, int intervals) {
  const auto reference = [&](std::size_t k, double& x_mm, double& y_mm) {
    x_mm = track.x_mm[k] - nominal.axle_offset_mm * std::cos(track.heading_rad[k]);
    y_mm = track.y_mm[k] - nominal.axle_offset_mm * std::sin(track.heading_rad[k]);
  };
  double left = 0, right = 0;
  std::size_t from = 0;
  for (int i = 0; i < intervals; ++i) {
    const std::size_t to = index_at(track, track.time_s[0] + (i + 1) * interval_s);
    double turn_rad = 0;
    for (std::size_t k = from; k < to; ++k) turn_rad += wrapped(track.heading_rad[k + 1] - track.heading_rad[k]);
    double from_x = 0, from_y = 0, to_x = 0, to_y = 0;
    reference(from, from_x, from_y);
    reference(to, to_x, to_y);
    const double half = 0.5 * turn_rad;
    // Along the chord's own direction, which is the heading halfway, so that a robot driving backwards counts as such.
    const double middle_rad = track.heading_rad[from] + half;
    const double chord_mm = (to_x - from_x) * std::cos(middle_rad) + (to_y - from_y) * std::sin(middle_rad);
    const double arc_mm = std::abs(half) > 1e-9 ? chord_mm * half / std::sin(half) : chord_mm;
    const double duration_s = track.time_s[to] - track.time_s[from];
    const double speed = arc_mm / duration_s, turn_speed = 0.5 * nominal.wheel_base_mm * turn_rad / duration_s;
    left += speed - turn_speed - nominal.speed_mm_s;
    right += speed + turn_speed - nominal.speed_mm_s;
    from = to;
  }
  return {left / intervals, right / intervals};
}

}  // namespace kilotwin::validation

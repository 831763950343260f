/// How effects change the motion of a robot. The simulator, the models that are fitted and the monitor compose effects by
/// these functions only.
///
/// A wheel whose speed before effects is u = f (v + b) gets the speed
///     w = u + [u (g - 1) + o]_L,    g = product of (1 + gain),    o = sum of the offsets,
/// and the body gets the velocity [s]_L to the left of its heading and [d]_L along each axis of the arena. s and d are
/// sums as well. [.]_L limits a magnitude to the limit L. Speeds in mm/s, gains relative. The derivative of the limit is
/// that from within. Source: docs/explanation/motion.md, section "Targets".
#pragma once

#include <algorithm>

#include "core/plan/effect_settings.hpp"

namespace kilotwin {

/// Sums over the offsets of one robot's effects, and products over their gains.
struct MotionChange {
  double left_gain = 1, right_gain = 1;
  double left_mm_s = 0, right_mm_s = 0;       ///< added to a wheel's speed
  double sideways_mm_s = 0;                   ///< to the left of the heading
  double drift_x_mm_s = 0, drift_y_mm_s = 0;  ///< in the arena
};

/// The offsets that an effect with the value 1 adds.
struct UnitOffsets {
  double left = 0, right = 0, sideways = 0, drift_x = 0, drift_y = 0;

  void add_to(MotionChange& change, double value) const {
    change.left_mm_s += left * value;
    change.right_mm_s += right * value;
    change.sideways_mm_s += sideways * value;
    change.drift_x_mm_s += drift_x * value;
    change.drift_y_mm_s += drift_y * value;
  }
};

/// `left`, `right`: the wheels of an offset. `along`, `across`: cosine and sine of a drift's direction. A turn rate in rad/s acts
/// by opposite offsets of the wheels. All zero for gains and for effects on measurement.
[[nodiscard]] constexpr UnitOffsets unit_offsets(EffectSettings::Target target, bool left, bool right, double along,
                                                 double across, double wheel_base_mm) {
  using enum EffectSettings::Target;
  switch (target) {
    case kWheelOffset: return {left ? 1.0 : 0.0, right ? 1.0 : 0.0};
    case kTurnRate: return {-wheel_base_mm / 2, wheel_base_mm / 2};
    case kBodyDrift: return {along, along, across};
    case kWorldDrift: return {0, 0, 0, along, across};
    default: return {};
  }
}

/// |v|, usable in constant expressions.
[[nodiscard]] constexpr double magnitude(double v) { return v < 0 ? -v : v; }

[[nodiscard]] constexpr double limited(double value, double limit) { return std::clamp(value, -limit, limit); }

/// w of above. `limit_mm_s`: L.
[[nodiscard]] constexpr double changed_speed(double speed_mm_s, double gain, double offset_mm_s,
                                             double limit_mm_s) {
  return speed_mm_s + limited(speed_mm_s * (gain - 1) + offset_mm_s, limit_mm_s);
}

/// Velocities of a robot in one tick, effects included.
struct DriveSpeeds {
  double left_mm_s = 0, right_mm_s = 0;  ///< of the wheels
  double sideways_mm_s = 0, drift_x_mm_s = 0, drift_y_mm_s = 0;
};

/// The wheels have the speeds `left_mm_s` and `right_mm_s` before effects.
[[nodiscard]] constexpr DriveSpeeds changed_speeds(double left_mm_s, double right_mm_s, const MotionChange& change,
                                                   double limit_mm_s) {
  return {changed_speed(left_mm_s, change.left_gain, change.left_mm_s, limit_mm_s),
          changed_speed(right_mm_s, change.right_gain, change.right_mm_s, limit_mm_s),
          limited(change.sideways_mm_s, limit_mm_s), limited(change.drift_x_mm_s, limit_mm_s),
          limited(change.drift_y_mm_s, limit_mm_s)};
}

}  // namespace kilotwin

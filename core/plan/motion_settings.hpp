/// Settings of the motion model and of single robots. Motion and RobotModel in idl/model.proto give meaning, units and defaults.
#pragma once

#include <cstdint>
#include <optional>

namespace kilotwin {

struct MotionSettings {
  bool noise = false;
  double straight_speed_mm_s = 0, turn_speed_mm_s = 0;
  double wheel_base_mm = 0, axle_offset_mm = 0;
  double bias_mean_mm_s = 0, bias_sd_mm_s = 0;
  double factor_variance_s = 0;
  std::uint32_t calibrated_straight_duty = 0, calibrated_turn_duty = 0;
  std::uint32_t dead_band_duty = 0;
  double duty_slope = 0, top_speed_ratio = 0;
  double spin_up_s = 0;
  double effects_limit_mm_s = 0;
};

/// An absent value is drawn at random, or is the common value of all robots.
struct RobotSettings {
  std::uint32_t robot = 0;
  std::optional<double> bias_left_mm_s, bias_right_mm_s;
  std::optional<std::uint32_t> turn_left, turn_right, straight_left, straight_right;  ///< duties
  std::optional<double> light_gain, light_offset;
};

}  // namespace kilotwin

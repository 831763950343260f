#include "core/model/robot_parameters.hpp"

#include "core/plan/motion_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin {
namespace {

/// Limits a stated duty to 1..255. A duty of 0 would never drive the wheel.
std::uint8_t duty(std::uint32_t stated) {
  return static_cast<std::uint8_t>(stated < 1 ? 1 : stated > 255 ? 255 : stated);
}

}  // namespace

RobotParameters::RobotParameters(const RunPlan& plan) : bias_(plan.robots(), {0, 0}) {
  const MotionSettings& motion = plan.motion_settings();
  const std::uint8_t turn = duty(motion.calibrated_turn_duty), straight = duty(motion.calibrated_straight_duty);
  calibration_.assign(plan.robots(), {turn, turn, straight, straight});

  const Random random(plan.seed());
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.tracked(robot)) continue;
    const auto draw = [&](std::uint32_t which) {
      return motion.bias_mean_mm_s + motion.bias_sd_mm_s * random.normal(Stream::kWheelBias, robot, Tick{0}, which);
    };
    bias_[robot] = {draw(0), draw(1)};
  }
  for (const RobotSettings& known : plan.robot_settings()) {
    if (known.robot >= plan.robots()) continue;
    WheelBias& bias = bias_[known.robot];
    if (known.bias_left_mm_s) bias.left_mm_s = *known.bias_left_mm_s;
    if (known.bias_right_mm_s) bias.right_mm_s = *known.bias_right_mm_s;
    Calibration& calibration = calibration_[known.robot];
    if (known.turn_left) calibration.turn_left = duty(*known.turn_left);
    if (known.turn_right) calibration.turn_right = duty(*known.turn_right);
    if (known.straight_left) calibration.straight_left = duty(*known.straight_left);
    if (known.straight_right) calibration.straight_right = duty(*known.straight_right);
  }
}

}  // namespace kilotwin

/// Inputs of effects: robots at one tick.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/spin_up.hpp"
#include "core/plan/effect_settings.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// Motor duties of a robot in a tick. The left motor drives the right-hand wheel.
struct Duties {
  std::uint8_t left = 0, right = 0;
  std::uint8_t spin_up = 0;  ///< how long both motors have full duty before: core/base/spin_up.hpp

  [[nodiscard]] bool any() const { return (left | right | spin_up) != 0; }
};

/// Decides which duties of a program turn a motor: none in the dead band, and no kick if the model has none.
class MotorRule {
 public:
  explicit MotorRule(const RunPlan&);

  [[nodiscard]] Duties acting(std::uint8_t left, std::uint8_t right, std::uint8_t spin_up) const {
    if (spin_up == kFullDuty) return {255, 255, 0};
    return {left > dead_band_duty_ ? left : std::uint8_t{0}, right > dead_band_duty_ ? right : std::uint8_t{0},
            kick_part_ > 0 ? spin_up : std::uint8_t{0}};
  }
  [[nodiscard]] std::uint8_t dead_band_duty() const { return dead_band_duty_; }
  /// Fraction of a tick at full duty, of a robot with this Duties::spin_up.
  [[nodiscard]] double kick_part(std::uint8_t spin_up) const {
    const double part = kick_part_ * (spin_up / static_cast<double>(kOneSpinUp));
    return part < 1 ? part : 1;
  }

 private:
  std::uint8_t dead_band_duty_;
  double kick_part_;
};

/// The motion command that these duties represent. A kick alone counts as STRAIGHT.
[[nodiscard]] inline MotionCommand command_of(Duties duties) {
  if (duties.left != 0) return duties.right != 0 ? MotionCommand::kStraight : MotionCommand::kTurnLeft;
  if (duties.right != 0) return MotionCommand::kTurnRight;
  return duties.spin_up != 0 ? MotionCommand::kStraight : MotionCommand::kStop;
}

/// Bit of a command in a set of commands.
[[nodiscard]] constexpr std::uint8_t bit_of(MotionCommand command) {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(command));
}

[[nodiscard]] constexpr bool is_turn(MotionCommand command) {
  return command == MotionCommand::kTurnLeft || command == MotionCommand::kTurnRight;
}

/// Robots at one tick in ascending ids: a view of columns of equal length.
struct RobotColumns {
  std::span<const std::uint32_t> robot;
  std::span<const double> x_mm, y_mm, heading_rad;
  std::span<const double> memory;         ///< RunPlan::memory.size() values per robot
  std::span<const Duties> duties;         ///< of the coming tick; 0 for real robots
  std::span<const std::uint8_t> tracked;  ///< 1: a real robot; effects do not act on it

  [[nodiscard]] std::size_t size() const { return robot.size(); }
};

}  // namespace kilotwin

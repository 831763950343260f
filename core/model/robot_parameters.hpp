/// Per-robot motion parameters: calibrated duties and wheel biases. A value is stated in the experiment or the model file, else it
/// is the default or a random draw. Physics, the programs' kilo_turn_left etc. and exports all resolve them here.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"

namespace kilotwin {

/// Motor duties, 1..255, at which the robot's wheels run at the nominal speeds: the values of its kilo_turn_left etc.
struct Calibration {
  std::uint8_t turn_left, turn_right, straight_left, straight_right;

  bool operator==(const Calibration&) const = default;
};

/// Speed added to the nominal speed of each wheel while the robot is driven, mm/s (Pinciroli 2018, section 2.2).
struct WheelBias {
  double left_mm_s, right_mm_s;
};

class RobotParameters {
 public:
  /// A pure function of the plan's experiment and seed.
  explicit RobotParameters(const RunPlan&);

  [[nodiscard]] std::uint32_t robots() const { return static_cast<std::uint32_t>(calibration_.size()); }
  [[nodiscard]] const Calibration& calibration(std::uint32_t robot) const { return calibration_[robot]; }
  /// The robot's bias, even if motion.noise of the experiment switches it off. A tracked robot has 0 unless a bias is stated.
  [[nodiscard]] const WheelBias& bias(std::uint32_t robot) const { return bias_[robot]; }

 private:
  std::vector<Calibration> calibration_;
  std::vector<WheelBias> bias_;
};

}  // namespace kilotwin

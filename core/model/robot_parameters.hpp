/// What each robot has of its own: calibrated duties and biases, stated in the experiment or the model file, else the
/// default or a draw. The one place that resolves them: for physics, for the programs' kilo_turn_left..., for exports.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"

namespace kilotwin {

/// Duties, 1..255, at which the robot's wheels run at the nominal speeds: what its kilo_turn_left... hold.
struct Calibration {
  std::uint8_t turn_left, turn_right, straight_left, straight_right;

  bool operator==(const Calibration&) const = default;
};

/// Added to the nominal speed of a wheel while the robot is driven, mm/s (the ARGoS paper, Pinciroli 2018, section 2.2).
struct WheelBias {
  double left_mm_s, right_mm_s;
};

class RobotParameters {
 public:
  /// A pure function of the plan's experiment and seed.
  explicit RobotParameters(const RunPlan&);

  [[nodiscard]] std::uint32_t robots() const { return static_cast<std::uint32_t>(calibration_.size()); }
  [[nodiscard]] const Calibration& calibration(std::uint32_t robot) const { return calibration_[robot]; }
  /// The robot's own, whether or not the experiment's motion.noise lets it act. 0 on tracked robots, unless stated.
  [[nodiscard]] const WheelBias& bias(std::uint32_t robot) const { return bias_[robot]; }

 private:
  std::vector<Calibration> calibration_;
  std::vector<WheelBias> bias_;
};

}  // namespace kilotwin

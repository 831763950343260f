/// Effects on motion: changes of the wheels' speeds and of the body's velocity.
#pragma once

#include <span>
#include <vector>

#include "core/effects/term.hpp"

namespace kilotwin {

/// Changes per robot, structure of arrays.
struct MotionChanges {
  std::vector<double> left_gain, right_gain;       ///< factor on a wheel's speed
  std::vector<double> left_mm_s, right_mm_s;       ///< added to a wheel's speed
  std::vector<double> sideways_mm_s;               ///< to the left of the heading
  std::vector<double> drift_x_mm_s, drift_y_mm_s;  ///< in the arena
};

class MotionEffects {
 public:
  explicit MotionEffects(const RunPlan&);

  [[nodiscard]] bool empty() const { return terms_.empty(); }
  /// Whether some effects move robots whose motors are off.
  [[nodiscard]] bool act_at_rest() const { return act_at_rest_; }
  [[nodiscard]] bool drift() const { return drift_; }
  /// Radius within which neighbours affect effects, mm.
  [[nodiscard]] double radius_mm() const { return terms_.covariates().radius_mm(); }

  /// Upper bounds of the changes: of a wheel's speed, of the sideways speed, of the drift along an axis, mm/s.
  struct Limits {
    double wheel_mm_s = 0, sideways_mm_s = 0, drift_mm_s = 0;
  };
  /// `top_wheel_mm_s`: largest speed of a wheel before effects.
  [[nodiscard]] Limits limits(double top_wheel_mm_s) const;

  /// Computes the changes of the robots robots[who[i]]. Covariates::fill explains `robots` and `fields`.
  void evaluate(Tick from, const RobotColumns& robots, std::span<const std::uint32_t> who,
                const ArenaFields* fields, MotionChanges&);

 private:
  /// Sums of gains per robot, of the left wheel and of the right one.
  struct GainSum {
    std::vector<double> left, right;
  };

  TermList terms_;
  std::vector<GainSum> sums_;  ///< within evaluate()
  double half_base_mm_, limit_mm_s_;
  bool act_at_rest_ = false, drift_ = false;
};

}  // namespace kilotwin

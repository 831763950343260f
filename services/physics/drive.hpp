/// The differential drive of a Kilobot: converts motor duties into the motion of the disc's centre, by exact arcs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/time.hpp"
#include "core/effects/motion_effects.hpp"
#include "core/effects/robots.hpp"
#include "core/model/robot_parameters.hpp"
#include "core/plan/plan.hpp"
#include "core/random/random.hpp"
#include "services/physics/drive_kernel.hpp"

namespace kilotwin::physics {

/// Displacement of the disc's centre in the body's frame at the start, and the turn.
struct Arc {
  double forward_mm, sideways_mm;  ///< sideways: to the left
  double cos_turn, sin_turn;
};

/// The midpoint of the axle travels `run_mm` along an arc while the body turns by `turn_rad`. The disc's centre lies
/// `axle_offset_mm` ahead of the axle.
[[nodiscard]] Arc arc_of(double run_mm, double turn_rad, double axle_offset_mm);

/// Driven robots of one tick as a structure of arrays, ascending by body. Columns are padded to multiples of eight. The
/// object lives across ticks only to reuse its memory.
struct Drives {
  std::vector<std::uint32_t> body;            ///< index of the body
  std::vector<double> left_mm_s, right_mm_s;  ///< actual speeds of the wheels
  std::vector<double> heading_rad;            ///< at the start of the tick
  std::vector<double> part;                   ///< fraction of the tick to which x_mm .. sin_turn apply
  std::vector<double> x_mm, y_mm;             ///< displacement of the centre without contact
  std::vector<double> cos_turn, sin_turn;
  std::vector<double> turn_rad;  ///< over the whole tick
  MotionChanges changes;         ///< by the model's effects; empty if it has none
  std::size_t count = 0;

  void reserve(std::size_t bodies);
  /// Rearranges the integrated columns so that body i has entry i, for bodies [0, bodies). Undriven bodies get zeros.
  void spread(std::size_t bodies);
};

/// Actual speed of a wheel = f (v + b) while either motor turns, 0 when both rest (the ARGoS paper, section 2.2). f is a
/// random factor per tick, b the robot's bias. v follows from the motor's duty and the robot's calibration:
/// idl/model.proto states the curve.
class DriveModel {
 public:
  explicit DriveModel(const RunPlan&);

  /// Decides which duties turn a motor.
  [[nodiscard]] const MotorRule& motors() const { return motors_; }
  [[nodiscard]] const MotionEffects& effects() const { return effects_; }

  /// Appends a robot with its acting duties. The left motor drives the right-hand wheel.
  void add(Drives&, std::uint32_t body, std::uint32_t robot, Tick from, Duties, double heading_rad,
           double part) const;
  /// Appends the robots with selected[i] = 1.
  void add(Drives&, const std::vector<std::uint8_t>& selected, const std::vector<std::uint32_t>& robot, Tick from,
           const std::vector<Duties>&, const std::vector<double>& heading_rad, double part) const;
  /// Applies the model's effects, which must not be empty(). Drives::body indexes `known`. Covariates::fill states which
  /// robots get exact values, and the meaning of `fields`.
  void change(Drives&, Tick from, const RobotColumns& known, const ArenaFields* fields);
  /// Computes displacements and turns from the wheels' speeds and the headings.
  void integrate(Drives&) const;

  /// Upper bound of the speed of a disc's centre by its drive, mm/s.
  [[nodiscard]] double top_speed_mm_s() const { return top_speed_mm_s_; }
  [[nodiscard]] double bias_left_mm_s(std::uint32_t robot) const { return bias_[robot].left_mm_s; }
  [[nodiscard]] double bias_right_mm_s(std::uint32_t robot) const { return bias_[robot].right_mm_s; }

 private:
  /// Speed of a wheel over the duty of its motor, mm/s.
  using Curve = std::array<double, 256>;
  /// Indices into curves_, per motor.
  struct Curves {
    std::uint16_t turn_left, turn_right, straight_left, straight_right;
  };
  struct Speeds {
    double left_mm_s, right_mm_s;  ///< of the wheels
  };

  void make_curves(const MotionSettings&, const RobotParameters&);
  [[nodiscard]] Speeds nominal(const Curves& of, std::uint8_t left, std::uint8_t right) const {
    if (left != 0 && right != 0) return {curves_[of.straight_right][right], curves_[of.straight_left][left]};
    return {curves_[of.turn_right][right], curves_[of.turn_left][left]};
  }
  [[nodiscard]] Speeds speeds_with_kick(std::uint32_t robot, Duties) const;
  template <bool kDrift> void integrate_one(Drives&, std::size_t i) const;

  Random random_;
  const DriveKernel* kernel_;
  double tick_s_, wheel_base_mm_, axle_offset_mm_;
  MotorRule motors_;
  MotionEffects effects_;
  MotionEffects::Limits limits_;
  double factor_sd_ = 0;  ///< standard deviation of f in one tick; 0: f = 1
  std::vector<Curve> curves_;
  std::vector<Curves> curves_of_;  ///< per robot
  std::vector<WheelBias> bias_;    ///< per robot
  double top_speed_mm_s_ = 0;
};

}  // namespace kilotwin::physics

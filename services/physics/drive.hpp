/// The differential drive of a Kilobot: motor duties to the motion of the disc's centre, by exact arcs.
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

/// Displacement of the disc's centre in the frame that the body had at the start, mm, and its turn, rad.
struct Arc {
  double forward_mm, sideways_mm;  ///< sideways: to the left
  double cos_turn, sin_turn;
};

/// The reference point runs `run_mm` along an arc while the body turns by `turn_rad`; the centre lies `axle_offset_mm`
/// ahead of it.
[[nodiscard]] Arc arc_of(double run_mm, double turn_rad, double axle_offset_mm);

/// Driven robots of one tick, structure of arrays, ascending; room for whole eights. Kept between ticks for its memory alone.
struct Drives {
  std::vector<std::uint32_t> body;            ///< index of the body
  std::vector<double> left_mm_s, right_mm_s;  ///< actual speeds of the wheels
  std::vector<double> heading_rad;            ///< at the start of the tick
  std::vector<double> part;                   ///< of the tick, over which the next four are meant
  std::vector<double> x_mm, y_mm;             ///< displacement of the centre, if nothing is in the way
  std::vector<double> cos_turn, sin_turn;
  std::vector<double> turn_rad;  ///< over the whole tick
  MotionChanges changes;         ///< by effects; where the model has any
  std::size_t count = 0;

  void reserve(std::size_t bodies);
  /// Puts what was integrated where the bodies' numbers say, for bodies [0, bodies); zeros for those that are not driven.
  void spread(std::size_t bodies);
};

/// Actual speed of a wheel = f (v + b) while either motor turns, 0 when both rest (seed, section 2.2). v follows from the
/// motor's duty and the robot's calibration: idl/model.proto states the curve.
class DriveModel {
 public:
  explicit DriveModel(const RunPlan&);

  /// Which of a program's duties turn a motor.
  [[nodiscard]] const MotorRule& motors() const { return motors_; }
  [[nodiscard]] const MotionEffects& effects() const { return effects_; }

  /// Adds a robot to the drives; its duties are acting. The left motor drives the right-hand wheel.
  void add(Drives&, std::uint32_t body, std::uint32_t robot, Tick from, Duties, double heading_rad,
           double part) const;
  /// Adds those robots that are `asked` for.
  void add(Drives&, const std::vector<std::uint8_t>& asked, const std::vector<std::uint32_t>& robot, Tick from,
           const std::vector<Duties>&, const std::vector<double>& heading_rad, double part) const;
  /// Applies the model's effects, which must not be empty(); `known` are the bodies that Drives::body counts. See
  /// Covariates::fill for whom they hold, and for `fields`.
  void change(Drives&, Tick from, const RobotColumns& known, const ArenaFields* fields);
  /// Fills what follows from the wheels' speeds and the headings.
  void integrate(Drives&) const;

  /// No disc's centre is ever driven faster, mm/s.
  [[nodiscard]] double top_speed_mm_s() const { return top_speed_mm_s_; }
  [[nodiscard]] double bias_left_mm_s(std::uint32_t robot) const { return bias_[robot].left_mm_s; }
  [[nodiscard]] double bias_right_mm_s(std::uint32_t robot) const { return bias_[robot].right_mm_s; }

 private:
  /// Speed of a wheel by its motor's duty, mm/s.
  using Curve = std::array<double, 256>;
  /// Indices into curves_, by motor.
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
  [[nodiscard]] Speeds kicked(std::uint32_t robot, Duties) const;
  template <bool kDrift> void integrate_one(Drives&, std::size_t i) const;

  Random random_;
  const DriveKernel* kernel_;
  double tick_s_, wheel_base_mm_, axle_offset_mm_;
  MotorRule motors_;
  MotionEffects effects_;
  MotionEffects::Limits limits_;
  double factor_sd_ = 0;  ///< of f in one tick; 0: f = 1
  std::vector<Curve> curves_;
  std::vector<Curves> curves_of_;  ///< per robot
  std::vector<WheelBias> bias_;    ///< per robot
  double top_speed_mm_s_ = 0;
};

}  // namespace kilotwin::physics

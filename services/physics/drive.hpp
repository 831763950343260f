/// The differential drive of a Kilobot: motor duties to the motion of the disc's centre, by exact arcs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/time.hpp"
#include "core/experiment/plan.hpp"
#include "core/random/random.hpp"

namespace kilotwin::physics {

/// A duty above the calibrated one speeds a wheel up to this ratio and no further.
inline constexpr double kTopDutyRatio = 1.5;

/// Displacement of the disc's centre in the frame that the body had at the start, mm, and its turn, rad.
struct Arc {
  double forward_mm, sideways_mm;  ///< sideways: to the left
  double cos_turn, sin_turn;
};

/// The reference point runs `run_mm` along an arc while the body turns by `turn_rad`; the centre lies `axle_offset_mm`
/// ahead of it.
[[nodiscard]] Arc arc_of(double run_mm, double turn_rad, double axle_offset_mm);

/// What a robot's program set its motors to.
struct Duties {
  std::uint8_t left = 0, right = 0;

  [[nodiscard]] bool any() const { return (left | right) != 0; }
};

/// Driven robots of one tick, structure of arrays, ascending. Kept between ticks for its memory alone.
struct Drives {
  std::vector<std::uint32_t> body;            ///< index of the body
  std::vector<double> left_mm_s, right_mm_s;  ///< actual speeds of the wheels
  std::vector<double> heading_rad;            ///< at the start of the tick
  std::vector<double> part;                   ///< of the tick, over which the next four are meant
  std::vector<double> x_mm, y_mm;             ///< displacement of the centre, if nothing is in the way
  std::vector<double> cos_turn, sin_turn;
  std::vector<double> turn_rad;  ///< over the whole tick
  std::size_t count = 0;

  void reserve(std::size_t bodies);
};

/// Actual speed of a wheel = f (v + b) while either motor is on, 0 when both are off (seed, section 2.2).
class DriveModel {
 public:
  explicit DriveModel(const RunPlan&);

  /// Adds a robot to the drives; either duty is above 0. The left motor drives the right-hand wheel.
  void add(Drives&, std::uint32_t body, std::uint32_t robot, Tick from, Duties, double heading_rad,
           double part) const;
  /// Fills what follows from the wheels' speeds and the headings.
  void integrate(Drives&) const;

  /// No disc's centre is ever driven faster, mm/s.
  [[nodiscard]] double top_speed_mm_s() const { return top_speed_mm_s_; }
  [[nodiscard]] double bias_left_mm_s(std::uint32_t robot) const { return bias_[robot].left_mm_s; }
  [[nodiscard]] double bias_right_mm_s(std::uint32_t robot) const { return bias_[robot].right_mm_s; }

 private:
  struct Bias {
    double left_mm_s = 0, right_mm_s = 0;
  };

  Random random_;
  double tick_s_, wheel_base_mm_, axle_offset_mm_;
  double factor_sd_ = 0;                                   ///< of f in one tick; 0: f = 1
  std::array<double, 256> straight_mm_s_{}, turn_mm_s_{};  ///< nominal speed of a wheel by its motor's duty
  std::vector<Bias> bias_;                                 ///< per robot
  double top_speed_mm_s_ = 0;
};

}  // namespace kilotwin::physics

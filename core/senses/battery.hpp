/// A robot's battery: what drains it, what charges it, and the voltage that its program reads. Charges are whole numbers of
/// uA cycles (1 uA during one cycle of 8 MHz, an eighth of a picocoulomb), so that energy balances exactly.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/ids.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::senses {

/// 10-bit reading of a battery of so many volts. The firmware's thresholds 682, 648 and 614 are 4.0, 3.8 and 3.6 V to the count
/// if the full range is 6 V: a divider by two before a converter with a reference of 3 V.
[[nodiscard]] constexpr double voltage_reading(double volts) { return volts * (1024 / 6.0); }

/// Volts of a lithium-ion cell without load, by charge 0..1: a generic discharge curve, piecewise linear.
[[nodiscard]] double open_circuit_volts(double charge);

class Battery {
 public:
  /// The plan's experiment has batteries.
  explicit Battery(const RunPlan&);

  /// Of a full one; more than 0.
  [[nodiscard]] std::int64_t capacity() const { return capacity_; }
  /// Of a robot at the start.
  [[nodiscard]] std::int64_t initial(std::uint32_t robot) const;

  struct Use {
    std::uint8_t motor_left = 0, motor_right = 0;  ///< duty 0..255
    std::uint8_t led = 0;                          ///< r | g << 2 | b << 4
    bool asleep = false, transmits = false;
  };
  /// What a robot takes in one tick.
  [[nodiscard]] std::int64_t drain(const Use& use) const {
    if (use.asleep) return sleep_;
    return idle_ + motor_[use.motor_left] + motor_[use.motor_right] + led_[use.led & 63] +
           (use.transmits ? transmission_ : 0);
  }
  /// What a robot at this place gets in one tick; 0 off all chargers.
  [[nodiscard]] std::int64_t supply(double x_mm, double y_mm) const;

  /// Average reading of its voltage while it takes `drain` per tick, counts.
  [[nodiscard]] double reading(std::int64_t charge, std::int64_t drain) const;
  /// Standard deviation of one reading, counts.
  [[nodiscard]] double sd() const { return sd_; }
  /// A flat robot starts again with this charge.
  [[nodiscard]] std::int64_t restart() const { return restart_; }

 private:
  struct Charger {
    double x_mm, y_mm, radius_mm;
    std::int64_t supply;
  };
  const RunPlan& plan_;
  std::int64_t capacity_, idle_, sleep_, transmission_, restart_, tick_cycles_;
  std::array<std::int64_t, 256> motor_{};  ///< per tick, by duty
  std::array<std::int64_t, 64> led_{};     ///< per tick, by colour
  double ohm_, sd_;
  std::vector<Charger> chargers_;
};

}  // namespace kilotwin::senses

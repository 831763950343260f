/// Battery model of a robot: loads, chargers, and the voltage that its program reads. Charges are integers in uA cycles: 1 uA
/// during one cycle of 8 MHz is an eighth of a picocoulomb. The charge balance is therefore exact.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/ids.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::senses {

/// ADC reading, counts, of a battery voltage. The full range of 1024 counts is 6 V: 3 V is the
/// converter's reference, behind a divider by two. With this range the firmware's thresholds 682, 648 and 614 are 4.0, 3.8 and 3.6 V to the count.
[[nodiscard]] constexpr double voltage_reading(double volts) { return volts * (1024 / 6.0); }

/// Open-circuit voltage of a lithium-ion cell, V, at state of charge 0..1: a generic discharge curve, piecewise linear.
[[nodiscard]] double open_circuit_volts(double charge);

class Battery {
 public:
  /// Requires plan.battery_settings().
  explicit Battery(const RunPlan&);

  /// Charge of a full battery, uA cycles; more than 0.
  [[nodiscard]] std::int64_t capacity() const { return capacity_; }
  /// Charge of a robot's battery at the start of the run.
  [[nodiscard]] std::int64_t initial(std::uint32_t robot) const;

  struct Use {
    std::uint8_t motor_left = 0, motor_right = 0;  ///< duty 0..255
    std::uint8_t led = 0;                          ///< r | g << 2 | b << 4
    bool asleep = false, transmits = false;
  };
  /// Charge that a robot draws in one tick.
  [[nodiscard]] std::int64_t drain(const Use& use) const {
    if (use.asleep) return sleep_;
    return idle_ + motor_[use.motor_left] + motor_[use.motor_right] + led_[use.led & 63] +
           (use.transmits ? transmission_ : 0);
  }
  /// Charge that a robot at this position receives in one tick; 0 outside all chargers.
  [[nodiscard]] std::int64_t supply(double x_mm, double y_mm) const;

  /// Mean reading of the voltage, counts, under a load of `drain` per tick.
  [[nodiscard]] double reading(std::int64_t charge, std::int64_t drain) const;
  /// The same as a voltage, V.
  [[nodiscard]] double volts(std::int64_t charge, std::int64_t drain) const;
  /// Standard deviation of one reading, counts.
  [[nodiscard]] double sd() const { return sd_; }
  /// Charge at which a robot with a flat battery starts again.
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

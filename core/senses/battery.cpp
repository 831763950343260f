#include "core/senses/battery.hpp"

#include <algorithm>

#include "core/math/elementary.h"
#include "core/plan/senses_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin::senses {
namespace {

constexpr double kCyclesPerHour = 3600 * 8e6;
/// Duration of a packet of kilolib: 13 octets of 10 bits, 269 cycles per bit.
constexpr std::int64_t kPacketCycles = 13 * 10 * 269;
/// A robot whose battery was flat starts again at this fraction of its capacity.
constexpr double kRestart = 0.05;

std::int64_t whole(double value) { return static_cast<std::int64_t>(kt_floor(value + 0.5)); }
std::int64_t microamperes(double mA) { return whole(mA * 1000); }

}  // namespace

double open_circuit_volts(double charge) {
  // A lithium-ion cell at small currents: 4.2 V when full, a plateau about 3.8 V, and a steep fall to 3.0 V when empty.
  static constexpr double kCharge[] = {0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1};
  static constexpr double kVolts[] = {3.0, 3.3, 3.45, 3.6, 3.7, 3.78, 3.86, 4.0, 4.08, 4.2};
  constexpr std::size_t last = std::size(kCharge) - 1;
  if (!(charge > 0)) return kVolts[0];
  for (std::size_t i = 1; i <= last; ++i) {
    if (charge <= kCharge[i]) {
      return kVolts[i - 1] +
             (kVolts[i] - kVolts[i - 1]) * ((charge - kCharge[i - 1]) / (kCharge[i] - kCharge[i - 1]));
    }
  }
  return kVolts[last];
}

Battery::Battery(const RunPlan& plan) : plan_(plan), tick_cycles_(plan.tick_length.cycles()) {
  const BatterySettings& battery = *plan.battery_settings();
  capacity_ = std::max<std::int64_t>(whole(battery.capacity_mAh * 1000 * kCyclesPerHour), 1);
  restart_ = whole(kRestart * static_cast<double>(capacity_));
  idle_ = microamperes(battery.idle_mA) * tick_cycles_;
  sleep_ = microamperes(battery.sleep_mA) * tick_cycles_;
  transmission_ = microamperes(battery.transmission_mA) * kPacketCycles;
  for (std::size_t duty = 0; duty < motor_.size(); ++duty)
    motor_[duty] = microamperes(battery.motor_mA * static_cast<double>(duty) / 255) * tick_cycles_;
  for (std::size_t led = 0; led < led_.size(); ++led) {
    const std::size_t levels = (led & 3) + (led >> 2 & 3) + (led >> 4);
    led_[led] = microamperes(battery.led_mA * static_cast<double>(levels) / 3) * tick_cycles_;
  }
  ohm_ = battery.resistance_ohm;
  sd_ = battery.reading_sd;
  for (const ChargerSettings& charger : battery.chargers) {
    chargers_.push_back(
        {charger.x_mm, charger.y_mm, charger.radius_mm, microamperes(charger.current_mA) * tick_cycles_});
  }
}

std::int64_t Battery::initial(std::uint32_t robot) const {
  const BatterySettings& battery = *plan_.battery_settings();
  double part = battery.charge;
  if (battery.charge_sd > 0)
    part += battery.charge_sd * Random(plan_.seed()).normal(Stream::kBattery, robot, Tick{0}, 0);
  return whole(std::clamp(part, 0.0, 1.0) * static_cast<double>(capacity_));
}

std::int64_t Battery::supply(double x_mm, double y_mm) const {
  std::int64_t most = 0;
  for (const Charger& charger : chargers_) {
    const double dx = x_mm - charger.x_mm, dy = y_mm - charger.y_mm;
    if (dx * dx + dy * dy <= charger.radius_mm * charger.radius_mm) most = std::max(most, charger.supply);
  }
  return most;
}

double Battery::volts(std::int64_t charge, std::int64_t drain) const {
  const double amperes = static_cast<double>(drain) / static_cast<double>(tick_cycles_) * 1e-6;
  const double part = static_cast<double>(charge) / static_cast<double>(capacity_);
  return open_circuit_volts(part) - ohm_ * amperes;
}

double Battery::reading(std::int64_t charge, std::int64_t drain) const {
  return voltage_reading(volts(charge, drain));
}

}  // namespace kilotwin::senses

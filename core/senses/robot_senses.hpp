/// Light, temperature and batteries of a share of the robots, as their programs read them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "core/senses/battery.hpp"
#include "core/senses/light_field.hpp"

namespace kilotwin::senses {

/// Mean and standard deviation of ADC readings, counts, before they are rounded and limited to 0..1023. The defaults hold for an
/// experiment that states nothing: light in the middle of the range and a charged battery. 682 is the firmware's threshold for
/// a full battery. The noise of the voltage makes rand_hard() random.
struct Readings {
  double light = 512, light_sd = 0;
  double voltage = 700, voltage_sd = 0.5;
  double temperature = 314 * (1024 / 1100.0), temperature_sd = 0;  ///< 25 degrees Celsius
  bool charging = false;  ///< a charger's voltage is on the robot's contacts
};

/// An index i counts the robots of the share from 0. Quantities that the experiment does not state are constant.
class RobotSenses {
 public:
  RobotSenses(const RunPlan&, Share share);

  /// Sets the swarm and the tick for readings(). Call it every tick if RunPlan::hosts_see_bodies(). The swarm must outlive the
  /// calls of readings().
  void at(const SwarmView&);
  [[nodiscard]] Readings readings(std::uint32_t i) const {
    Readings result;
    if (light_) {
      result.light = light_->reading(share_.first + i);
      result.light_sd = light_->sd(result.light);
    }
    if (battery_) {
      result.voltage = battery_->reading(charge_[i], drain_[i]);
      result.voltage_sd = battery_->sd();
      result.charging = supply_[i] > 0 && charge_[i] < battery_->capacity();
    }
    result.temperature = temperature_[i];
    result.temperature_sd = temperature_sd_;
    return result;
  }

  [[nodiscard]] bool has_batteries() const { return battery_.has_value(); }
  /// Charge of the battery, uA cycles (see Battery).
  [[nodiscard]] std::int64_t charge(std::uint32_t i) const { return charge_[i]; }
  /// Voltage of the battery under the load of the last tick, V. Requires has_batteries().
  [[nodiscard]] double battery_V(std::uint32_t i) const { return battery_->volts(charge_[i], drain_[i]); }
  /// Advances the charge by one tick with this load and the charger, if the robot stands on one.
  void spend(std::uint32_t i, const Battery::Use& use) { settle(i, battery_->drain(use)); }
  /// Advances the charge of a robot that is off by one tick.
  void rest(std::uint32_t i) { settle(i, 0); }
  [[nodiscard]] bool is_flat(std::uint32_t i) const { return charge_[i] == 0; }
  [[nodiscard]] bool can_restart(std::uint32_t i) const { return charge_[i] >= battery_->restart(); }

  /// For checkpoints.
  [[nodiscard]] std::int64_t drain(std::uint32_t i) const { return drain_[i]; }
  void restore(std::uint32_t i, std::int64_t charge, std::int64_t drain);

 private:
  void settle(std::uint32_t i, std::int64_t drain);

  const Share share_;
  std::optional<LightField> light_;
  std::vector<double> temperature_;  ///< mean readings, counts
  double temperature_sd_ = 0;
  std::optional<Battery> battery_;
  std::vector<std::int64_t> charge_, drain_,
      supply_;  ///< uA cycles; drain_ and supply_ per tick, of the current tick
};

}  // namespace kilotwin::senses

/// What surrounds some of a run's robots while their programs run: light, temperature, and their batteries.
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

/// What a robot's converter gives on average, counts before they are rounded and cut to 0..1023, and the spread of one reading.
/// Where the experiment says nothing: light in the middle of the range, and a charged battery, above 682, the firmware's
/// threshold for full, with the noise that makes rand_hard() random.
struct Readings {
  double light = 512, light_sd = 0;
  double voltage = 700, voltage_sd = 0.5;
  double temperature = 314 * (1024 / 1100.0), temperature_sd = 0;  ///< 25 degrees Celsius
  bool charging = false;                                           ///< a charger's voltage is on its contacts
};

/// Indices are those of robots within the share. Where the experiment says nothing, readings are constant.
class RobotSenses {
 public:
  RobotSenses(const RunPlan&, Share share);

  /// The surroundings among a swarm, at its tick; needed where RunPlan::hosts_see_bodies(). The swarm must outlive readings.
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
  /// uA cycles; see Battery.
  [[nodiscard]] std::int64_t charge(std::uint32_t i) const { return charge_[i]; }
  /// One tick of use, and of what a charger gives.
  void spend(std::uint32_t i, const Battery::Use& use) { settle(i, battery_->drain(use)); }
  /// One tick of a robot that is off.
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
  std::vector<double> temperature_;  ///< average readings
  double temperature_sd_ = 0;
  std::optional<Battery> battery_;
  std::vector<std::int64_t> charge_, drain_, supply_;  ///< the latter two of the tick at hand
};

}  // namespace kilotwin::senses

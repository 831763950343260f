/// What surrounds the robots of one host while their programs run: light, temperature, and their batteries.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "clients/behaviours/runtime/image_abi.h"
#include "core/experiment/plan.hpp"
#include "core/federation/frames.hpp"
#include "core/senses/battery.hpp"
#include "core/senses/light_field.hpp"

namespace kilotwin::behaviours {

/// Indices are those of robots within the share. Where the experiment says nothing, readings are constant.
class RobotSenses {
 public:
  RobotSenses(const RunPlan&, Share share);

  /// The surroundings of `tick`. `bodies`: the poses of that tick from all partitions, where RunPlan::hosts_see_bodies().
  void at(Tick tick, std::span<const BodyFrame* const> bodies);
  /// All but the EEPROM.
  void surround(std::uint32_t i, std::uint32_t receptions, KtSurroundings& around) const;

  [[nodiscard]] bool has_batteries() const { return battery_.has_value(); }
  /// uA cycles; see senses::Battery.
  [[nodiscard]] std::int64_t charge(std::uint32_t i) const { return charge_[i]; }
  /// One tick of use, and of what a charger gives.
  void spend(std::uint32_t i, const senses::Battery::Use& use) { settle(i, battery_->drain(use)); }
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
  std::optional<senses::LightField> light_;
  std::vector<double> temperature_;  ///< average readings
  double temperature_sd_ = 0;
  std::optional<senses::Battery> battery_;
  std::vector<std::int64_t> charge_, drain_, supply_;  ///< the latter two of the tick at hand
};

}  // namespace kilotwin::behaviours

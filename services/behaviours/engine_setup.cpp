/// State of a host's engine at tick 0: groups of robots, brought EEPROMs, ranging tables.
#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/error.hpp"
#include "core/plan/tracking_settings.hpp"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::uint16_t kInitialTxPeriod = 3906;  // kilolib: half a second in counts of 128 us

}  // namespace

BehavioursEngine::BehavioursEngine(const RunPlan& plan, HostId host, std::shared_ptr<ProgramSet> programs)
    : plan_(plan),
      host_(host),
      share_(plan.share(host)),
      random_(plan.seed()),
      parameters_(plan),
      programs_(std::move(programs)),
      senses_(plan, share_),
      memory_(share_.size()),
      calibrated_(share_.size(), 0),
      eeprom_(share_.size()),
      presence_(share_.size(), Presence::kNone),
      motor_left_(share_.size()),
      motor_right_(share_.size()),
      spin_up_(share_.size()),
      led_(share_.size()),
      life_cycle_(share_.size(), static_cast<std::uint8_t>(LifeCycle::kIdle)),
      motor_share_(share_.size()),
      absent_(share_.size()),
      seen_led_(share_.size(), kUnknownLed),
      tx_period_(share_.size(), kInitialTxPeriod),
      holds_(share_.size()),
      offers_(share_.size()),
      message_(share_.size()),
      crc_error_(share_.size()),
      is_due_(share_.size()),
      due_(share_.size()),
      requested_(share_.size()),
      sent_(share_.size()),
      first_reception_(share_.size() + 1),
      wait_period_(share_.size()),
      probes_(programs_->size()),
      warned_(programs_->size()) {
  KILOTWIN_DEMAND(programs_->size() == static_cast<std::uint32_t>(plan.programs().size()));
  for (const RobotEeprom& brought : plan.eeproms()) {
    if (!share_.contains(brought.robot)) continue;
    auto& eeprom = eeprom_[brought.robot - share_.first] = std::make_unique<Eeprom>();
    std::copy_n(brought.content.begin(), eeprom->size(), eeprom->begin());
  }
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    if (!plan.tracked(share_.first + i) || plan.tracking_settings().present_at_start) continue;
    absent_[i] = 1;
    life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kAbsent);
  }
  if (const RadioParameters radios(plan); radios.own_tables()) calibrate_ranging(radios);
  // Hosts in one process start at different slots, so that they seldom wait for each other's mutex.
  const std::uint32_t first_slot = host.value() * kSlots / std::max(plan.hosts, 1u);
  for (std::uint32_t s = 0; s < kSlots; ++s) {
    for (std::uint32_t p = 0; p < programs_->size(); ++p) {
      if (plan.programs()[p].firmware) continue;
      Group group{p, (first_slot + s) % kSlots, {}};
      for (std::uint32_t i = 0; i < share_.size(); ++i) {
        const std::uint32_t robot = share_.first + i;
        if (robot % kSlots == group.slot && plan.program_of(robot) == p) group.robots.push_back(i);
      }
      for (const std::uint32_t i : group.robots) presence_[i] = Presence::kNew;
      if (!group.robots.empty()) groups_.push_back(std::move(group));
    }
  }
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    if (plan.firmware(share_.first + i)) presence_[i] = Presence::kFirmware;
  }
}

/// Gives each robot without a stated EEPROM one with its own ranging table.
void BehavioursEngine::calibrate_ranging(const RadioParameters& radios) {
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    const std::uint32_t id = share_.first + i;
    if (eeprom_[i] || plan_.program_of(id) == kNoProgram || plan_.firmware(id)) continue;
    const Calibration& calibration = parameters_.calibration(id);
    const RangingTable table = radios.table(id);
    eeprom_[i] = std::make_unique<Eeprom>();
    kilotwin_fill_eeprom(eeprom_[i]->data(), {plan_.uid_of(id), calibration.turn_left, calibration.turn_right,
                                              calibration.straight_left, calibration.straight_right});
    calibrated_[i] = 1;
    kilotwin_fill_ranging(eeprom_[i]->data(), table.high.data(), table.low.data());
  }
}

}  // namespace kilotwin::behaviours

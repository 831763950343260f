/// Saves and loads a host's state per robot.
#include <algorithm>
#include <array>
#include <cstring>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {
namespace {

std::span<const std::uint8_t> octets(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};  // NOLINT
}

std::string text(std::span<const std::uint8_t> octets) {
  return {reinterpret_cast<const char*>(octets.data()), octets.size()};  // NOLINT
}

/// Layout of RobotProgramState.host: these octets in this order, then the text of the failure.
enum Field : std::size_t {
  kPresence,
  kLeft,
  kRight,
  kLed,
  kLifeCycle,
  kPeriodLow,
  kPeriodHigh,
  kHolds,
  kOffers,
  kMessage,
  kSpinUp = kMessage + 10,
  kSeenLed,
  kIsDue,
  kDue,
  kCrcErrorLow = kDue + 10,
  kCrcErrorHigh,
  kMotorShare,
  kFields = kMotorShare + sizeof(MotorShare)
};

}  // namespace

void BehavioursEngine::save(proto::BehavioursState& state) const {
  state.Clear();
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    proto::RobotProgramState& robot = *state.add_robot();
    robot.set_robot(share_.first + i);
    robot.set_memory(text(memory_[i].data()));
    robot.set_stack(text(memory_[i].stack()));
    std::array<std::uint8_t, kFields> fields{};
    fields[kPresence] = static_cast<std::uint8_t>(presence_[i]);
    fields[kLeft] = motor_left_[i];
    fields[kRight] = motor_right_[i];
    fields[kSpinUp] = spin_up_[i];
    fields[kLed] = led_[i];
    fields[kLifeCycle] = life_cycle_[i];
    fields[kPeriodLow] = static_cast<std::uint8_t>(tx_period_[i] & 0xff);
    fields[kPeriodHigh] = static_cast<std::uint8_t>(tx_period_[i] >> 8);
    fields[kSeenLed] = seen_led_[i];
    fields[kIsDue] = is_due_[i];
    std::copy(due_[i].begin(), due_[i].end(), fields.begin() + kDue);
    fields[kCrcErrorLow] = static_cast<std::uint8_t>(crc_error_[i] & 0xff);
    fields[kCrcErrorHigh] = static_cast<std::uint8_t>(crc_error_[i] >> 8);
    fields[kHolds] = holds_[i];
    std::memcpy(&fields[kMotorShare], &motor_share_[i], sizeof(MotorShare));
    fields[kOffers] = offers_[i];
    std::copy(message_[i].begin(), message_[i].end(), fields.begin() + kMessage);
    robot.set_host(text(fields));
    if (senses_.has_batteries()) {
      robot.set_charge(senses_.charge(i));
      robot.set_drain(senses_.drain(i));
    }
    if (eeprom_[i]) robot.set_eeprom(text(*eeprom_[i]));
  }
  for (const Failure& failure : failures_) {
    state.mutable_robot(static_cast<int>(failure.robot - share_.first))->mutable_host()->append(failure.text);
  }
}

void BehavioursEngine::load(Tick tick, std::span<const proto::BehavioursState* const> parts) {
  std::vector<const proto::RobotProgramState*> saved(share_.size(), nullptr);
  for (const proto::BehavioursState* part : parts) {
    for (const proto::RobotProgramState& robot : part->robot()) {
      if (share_.contains(robot.robot())) saved[robot.robot() - share_.first] = &robot;
    }
  }
  now_ = tick;
  failures_.clear();
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    const std::uint32_t id = share_.first + i;
    const bool has_none = plan_.program_of(id) == kNoProgram;
    if (saved[i] == nullptr || saved[i]->host().size() < kFields) {
      throw RunError("robot " + std::to_string(id) + " is missing in the checkpoint");
    }
    const auto fields = octets(saved[i]->host());
    const auto presence = Presence{fields[kPresence]};
    if (presence > Presence::kFirmware || (presence == Presence::kNone) != has_none ||
        (presence == Presence::kFirmware) != plan_.firmware(id)) {
      throw RunError("robot " + std::to_string(id) +
                     " is firmware, tracked or a program here, and another of these in the checkpoint");
    }
    presence_[i] = presence;
    memory_[i].release();
    if (presence == Presence::kAlive) {
      const Program& program = programs_->program(plan_.program_of(id));
      memory_[i].restore(program, program.slot(id % kSlots), octets(saved[i]->memory()), octets(saved[i]->stack()));
    } else if (presence == Presence::kFailed || saved[i]->host().size() > kFields) {
      failures_.push_back({id, saved[i]->host().substr(kFields)});
    }
    if (senses_.has_batteries()) senses_.restore(i, saved[i]->charge(), saved[i]->drain());
    eeprom_[i].reset();
    if (const auto eeprom = octets(saved[i]->eeprom()); eeprom.size() == KILOTWIN_EEPROM_OCTETS) {
      eeprom_[i] = std::make_unique<Eeprom>();
      std::copy(eeprom.begin(), eeprom.end(), eeprom_[i]->begin());
    }
    motor_left_[i] = fields[kLeft];
    motor_right_[i] = fields[kRight];
    spin_up_[i] = fields[kSpinUp];
    std::memcpy(&motor_share_[i], &fields[kMotorShare], sizeof(MotorShare));
    led_[i] = fields[kLed];
    life_cycle_[i] = fields[kLifeCycle];
    tx_period_[i] = static_cast<std::uint16_t>(fields[kPeriodLow] | fields[kPeriodHigh] << 8);
    seen_led_[i] = fields[kSeenLed];
    absent_[i] = static_cast<std::uint8_t>(fields[kLifeCycle] == static_cast<std::uint8_t>(LifeCycle::kAbsent));
    is_due_[i] = fields[kIsDue];
    std::copy_n(fields.begin() + kDue, 10, due_[i].begin());
    holds_[i] = fields[kHolds];
    offers_[i] = fields[kOffers];
    std::copy_n(fields.begin() + kMessage, 10, message_[i].begin());
    crc_error_[i] = static_cast<std::uint16_t>(fields[kCrcErrorLow] | fields[kCrcErrorHigh] << 8);
  }
}

}  // namespace kilotwin::behaviours

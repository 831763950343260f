#include "services/behaviours/engine.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/message_crc.h"
#include "core/base/spin_up.hpp"
#include "core/base/state_hash.hpp"

namespace kilotwin::behaviours {
namespace {

/// Duration of a packet, cycles: 13 octets of 10 bits of 269 cycles (kilolib). Meanwhile the receivers' ADCs are busy and the
/// sender's processor has interrupts disabled.
constexpr std::uint64_t kPacketCycles = 13 * 10 * 269;
/// A program fails after one second in a loop without exit and without calls.
constexpr std::int64_t kPatienceCycles = 8'000'000;
/// Prefetch distance: a robot's memory is prefetched while the robot this many places before it runs.
constexpr std::size_t kAhead = 2;

/// Per program: number of probes of loop(), and ticks between two of them.
constexpr std::uint32_t kProbes = 8;
constexpr std::int64_t kProbePeriod = 37;

/// A program whose loop() settles in none of that many calls of a tick is slow to simulate.
constexpr std::int64_t kManyCalls = 64;

/// Draws of Stream::kProgram per robot and tick.
constexpr std::uint32_t kNoiseSeed = 0, kInterruptedCycle = 1;

}  // namespace

/// One robot's program in one tick.
struct BehavioursEngine::Span {
  const Program& program;
  const Slot& slot;
  bool eventful;      ///< callbacks have run in this tick
  bool kept = false;  ///< memory_ holds what the slot holds, besides KtRobot
  /// Cycles of a call of loop() that changes nothing and was skipped for the rest of the tick; 0: no call was skipped.
  std::int32_t call_cycles = 0;
};

void BehavioursEngine::gather(const RadioFrame& radio) {
  auto own = [&](std::uint32_t robot) {
    KILOTWIN_DEMAND(share_.contains(robot));
    return robot - share_.first;
  };
  std::fill(requested_.begin(), requested_.end(), std::uint8_t{0});
  std::fill(sent_.begin(), sent_.end(), std::uint8_t{0});
  for (const std::uint32_t robot : radio.ask) requested_[own(robot)] = 1;
  for (const std::uint32_t robot : radio.sent) sent_[own(robot)] = 1;

  messages_.resize(radio.messages.size());
  wrong_crc_ = !radio.message_crc_error.empty();
  for (std::size_t m = 0; m < radio.messages.size(); ++m) {
    const IrMessage& message = radio.messages[m];
    std::copy_n(message.begin(), 9, messages_[m].data);
    messages_[m].type = message[9];
    const std::uint16_t error = wrong_crc_ ? radio.message_crc_error[m] : std::uint16_t{0};
    messages_[m].crc = kilotwin_message_crc(message.data()) ^ error;
  }
  receptions_.resize(radio.reception_robot.size());
  std::uint32_t next = 0;
  for (std::uint32_t n = 0; n < receptions_.size(); ++n) {
    const std::uint32_t i = own(radio.reception_robot[n]);
    KILOTWIN_DEMAND(i + 1 >= next && radio.reception_message[n] < messages_.size());
    while (next <= i) first_reception_[next++] = n;
    receptions_[n] = {messages_[radio.reception_message[n]], radio.reception_low_gain[n],
                      radio.reception_high_gain[n]};
  }
  while (next < first_reception_.size()) first_reception_[next++] = static_cast<std::uint32_t>(receptions_.size());
}

void BehavioursEngine::step(Tick from, const RadioFrame& radio, const SwarmView* swarm,
                            const TrackedInputs& tracked) {
  KILOTWIN_DEMAND(from == now_ && radio.tick == from && radio.first_robot == share_.first &&
                  radio.kilo_ticks.size() == share_.size());
  ++now_;
  gather(radio);
  if (swarm != nullptr) senses_.at(*swarm);
  take_memberships(tracked);
  printed_.clear();
  std::fill(offers_.begin(), offers_.end(), std::uint8_t{0});
  running_->tick.store(from.count(), std::memory_order_relaxed);
  fail_known_culprits(from);
  const FaultGuard guard;
  for (const Group& group : groups_) {
    const Program& program = programs_->program(group.program);
    Slot& slot = program.slot(group.slot);
    const std::lock_guard lock(slot.mutex);
    const Executor executor(program, slot, guard.thread());
    slot.exchange()->log_length = slot.exchange()->log_lost = 0;
    for (std::size_t n = 0; n < group.robots.size(); ++n) {
      // Other engines have replaced the caches' content since the last tick.
      if (n + kAhead < group.robots.size()) memory_[group.robots[n + kAhead]].prefetch();
      const std::uint32_t i = group.robots[n];
      if (absent_[i] != 0) continue;
      run_robot(from, i, radio.kilo_ticks[i], program, slot, executor);
      if (slot.exchange()->log_length != 0) take_log(i, slot);
    }
    running_->robot.store(kNobody, std::memory_order_relaxed);
  }
  relay_firmware(radio);
  if (tracked.frame != nullptr) follow(*tracked.frame);
  if (!senses_.has_batteries()) return;
  for (std::uint32_t i = 0; i < share_.size(); ++i) use_battery(i);
}

/// Copies the outputs of firmware robots at tick k into the frame of tick k + 1. Programs that run here have the same delay, so
/// both kinds of robots move at the same time.
void BehavioursEngine::relay_firmware(const RadioFrame& radio) {
  for (std::size_t n = 0; n < radio.firmware_robot.size(); ++n) {
    const std::uint32_t robot = radio.firmware_robot[n], i = robot - share_.first;
    KILOTWIN_DEMAND(share_.contains(robot) && presence_[i] == Presence::kFirmware);
    motor_left_[i] = radio.firmware_motor_left[n];
    motor_right_[i] = radio.firmware_motor_right[n];
    spin_up_[i] = radio.firmware_spin_up[n];
    led_[i] = radio.firmware_led[n];
    const bool failed = life_cycle_[i] == static_cast<std::uint8_t>(LifeCycle::kFailed);
    life_cycle_[i] = radio.firmware_life_cycle[n];
    if (const std::uint32_t fault = radio.firmware_fault[n]; fault != 0 && !failed) {
      constexpr const char* kCauses[] = {"", "no instruction of the ATmega328P",
                                         "an access to memory that the ATmega328P does not have"};
      char text[128];
      std::snprintf(text, sizeof text, "its firmware executed %s, at 0x%04x of the flash",
                    kCauses[std::min(fault >> 24, 2u)], fault & 0xffffffu);
      failures_.push_back({robot, text});
    }
  }
}

void BehavioursEngine::use_battery(std::uint32_t i) {
  if (presence_[i] != Presence::kNew && presence_[i] != Presence::kAlive) return;
  constexpr auto kFlat = static_cast<std::uint8_t>(LifeCycle::kFlat);
  if (life_cycle_[i] == kFlat) {
    senses_.rest(i);
    if (senses_.can_restart(i)) life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kIdle);
    return;
  }
  const bool asleep = life_cycle_[i] == static_cast<std::uint8_t>(LifeCycle::kSleeping);
  senses_.spend(i, {motor_left_[i], motor_right_[i], led_[i], asleep, sent_[i] != 0});
  if (!senses_.is_flat(i)) return;
  // The robot switches off and loses its memory.
  presence_[i] = Presence::kNew;
  memory_[i].release();
  life_cycle_[i] = kFlat;
  motor_left_[i] = motor_right_[i] = spin_up_[i] = led_[i] = 0;
  holds_[i] = offers_[i] = 0;
}

// NOLINTNEXTLINE(readability-function-size): the steps of one tick, in their order
void BehavioursEngine::run_robot(Tick from, std::uint32_t i, std::uint8_t kilo_ticks, const Program& program,
                                 const Slot& slot, const Executor& executor) {
  spin_up_[i] = 0;
  if (presence_[i] == Presence::kFailed || life_cycle_[i] == static_cast<std::uint8_t>(LifeCycle::kFlat)) return;
  if (presence_[i] == Presence::kNew) reset_robot(from, i, program, slot);
  RobotMemory& memory = memory_[i];
  std::span<const KtReception> receptions(receptions_.data() + first_reception_[i],
                                          receptions_.data() + first_reception_[i + 1]);
  bool sent = (sent_[i] & holds_[i]) != 0;
  if (sent_[i] != 0) holds_[i] = 0;

  const bool deaf = memory.get<std::uint8_t>(program, program.file.table.robot + offsetof(KtRobot, deaf)) != 0;
  if (deaf) {
    receptions = {};
    sent = false;
    kilo_ticks = 0;
  }
  const bool eventful = !receptions.empty() || sent;
  if (!eventful && memory.get<std::uint8_t>(program, program.file.table.robot + offsetof(KtRobot, parked)) != 0) {
    const auto ticks = memory.get<std::uint32_t>(program, program.file.table.ticks);
    memory.set(program, program.file.table.ticks, ticks + kilo_ticks);
    // It may have parked in the tick of a flash, whose colour led_ then shows.
    led_[i] = memory.get<std::uint8_t>(program, program.file.table.robot + offsetof(KtRobot, led)) & 63;
    return;
  }

  running_->robot.store(share_.first + i, std::memory_order_relaxed);
  running_->entry.store(running_->entry.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  RobotThread& thread = executor.thread();
  thread.divided = 0;
  memory.copy_in(slot, thread);
  executor.advance_clock(kilo_ticks);
  set_surroundings(i, slot, static_cast<std::uint32_t>(receptions.size()));
  std::int32_t interrupted_cycles = 0;
  if (eventful) {
    slot.exchange()->wrong_crc = wrong_crc_ ? 1 : 0;
    const Fault* const fault = executor.interrupt(receptions, sent, interrupted_cycles);
    if (fault != nullptr) return fail_robot(i, *fault, program, slot);
    if (executor.robot().reset != 0) {
      static_cast<void>(memory.copy_out(slot, executor.data_octets(), thread));
      reset_robot(from, i, program, slot);
      memory.copy_in(slot, thread);
      sent = false;
      interrupted_cycles = 0;
    }
  }
  Span span{program, slot, eventful};
  if (executor.robot().parked == 0) {
    if (sent) interrupted_cycles += static_cast<std::int32_t>(kPacketCycles);
    const Fault* const fault = run_main(i, executor, interrupted_cycles, span);
    if (fault != nullptr) return fail_robot(i, *fault, program, slot);
  }
  // Read single fields. A copy of the whole struct would stall: store forwarding fails for parts that the robot has just written.
  KtRobot& robot = executor.robot();
  if (robot.state != static_cast<std::uint8_t>(LifeCycle::kRunning)) holds_[i] = 0;
  if (requested_[i] != 0 && holds_[i] == 0 && robot.state == static_cast<std::uint8_t>(LifeCycle::kRunning)) {
    const KtMessage* message = nullptr;
    std::int32_t cycles = 0;
    span.kept = false;
    const Fault* const fault = transmit(i, executor, span, message, cycles);
    if (fault != nullptr) return fail_robot(i, *fault, program, slot);
    if (robot.loop_rate == KT_LOOP_AS_ON_ROBOT) robot.debt_cycles += static_cast<std::uint64_t>(cycles);
    if (message != nullptr) {
      std::copy_n(message->data, 9, message_[i].begin());
      message_[i][9] = message->type;
      crc_error_[i] = message->crc ^ kilotwin_message_crc(message_[i].data());
      if (crc_error_[i] != 0) note_wrong_crc(i, message->crc);
      holds_[i] = offers_[i] = 1;
    }
  }
  if (slot.surroundings()->eeprom_written != 0) keep_eeprom(i, slot);
  note_outputs(i, robot, slot, executor.tx_period());
  // A flash within a tick is seen as often as it lasts. The end of the tick would always miss it, as callbacks run at its beginning.
  const KtSurroundings& around = *slot.surroundings();
  if (around.led_changes > 1 && around.led_changes <= KT_MOST_FLASHES) led_[i] = around.led_sampled & 63;
  if (slot.exchange()->overflows != 0) note_overflows(i, *slot.exchange(), program, slot);
  if (slot.exchange()->heap_full != 0) note_full_heap(i, *slot.exchange(), program, slot);
  if (slot.exchange()->ended != 0) {
    slot.exchange()->ended = 0;
    if (is_first(i, Warning::kEnded))
      warnings_.push_back(
          {share_.first + i,
           "its main() has ended, so it does nothing more; main() ends with kilo_start(setup, loop)"});
  }
  if (thread.divided != 0) note_division(i, thread.divided, program, slot);
  if (!slot.clear_before_data()) return fail_robot(i, Fault{Fault::kBeforeVariables, 0, 0}, program, slot);
  if (span.kept)
    memory.set(program, program.file.table.robot, robot);
  else if (!memory.copy_out(slot, executor.data_octets(), thread))
    return fail_robot(i, Fault{Fault::kStackLost, 0, 0}, program, slot);
  if (robot.loop_rate != KT_LOOP_PER_TICK) return;
  const LoopProbe& probe = probes_[plan_.program_of(share_.first + i)];
  if (probe.done < kProbes && from.count() >= probe.next) probe_loop(i, program, slot, executor);
}

/// Calls loop() once more in this tick, in the slot, and discards the result. On a robot loop() runs as often as it can. If
/// further calls change the program's variables or outputs although nothing has happened, their number matters.
void BehavioursEngine::probe_loop(std::uint32_t i, const Program& program, const Slot& slot,
                                  const Executor& executor) {
  LoopProbe& probe = probes_[plan_.program_of(share_.first + i)];
  const KtRobot before = executor.robot();
  const bool rests = before.debt_cycles == 0 && wait_period_[i] == 0 &&
                     before.state == static_cast<std::uint8_t>(LifeCycle::kRunning);
  if (!rests) return;
  probe.next = now_.count() + kProbePeriod;
  ++probe.done;
  KtSurroundings& around = *slot.surroundings();
  if (around.eeprom != nullptr) {  // the call may write to it
    std::copy_n(around.eeprom, sizeof around.eeprom_copy, around.eeprom_copy);
    around.eeprom = nullptr;
    around.eeprom_filled = 1;
  }
  around.receiving_cycles = 0;
  const std::uint32_t printed = slot.exchange()->log_length;
  const auto budget = static_cast<std::int32_t>(plan_.tick_length.cycles());
  const Executor::Main main = executor.run_main(budget, 0);
  slot.exchange()->log_length = printed;
  slot.exchange()->overflows = slot.exchange()->ended = 0;
  const KtRobot& after = executor.robot();
  if (main.fault != nullptr || main.preempted || after.waits != before.waits + 1) return;
  const auto saved = memory_[i].data();
  const std::size_t hardware = program.file.table.robot - program.file.data.first;
  const std::uint8_t* const now = slot.data();
  const bool same = std::equal(saved.begin(), saved.begin() + static_cast<std::ptrdiff_t>(hardware), now) &&
                    std::equal(saved.begin() + static_cast<std::ptrdiff_t>(hardware + sizeof(KtRobot)), saved.end(),
                               now + hardware + sizeof(KtRobot)) &&
                    after.duty_left == before.duty_left && after.duty_right == before.duty_right &&
                    after.led == before.led;
  if (same) return;
  ++probe.changed;
  probe.cycles += std::max(budget - main.left, 1);
  if (probe.done < kProbes || probe.changed < kProbes * 3 / 4) return;
  char text[224];
  std::snprintf(
      text, sizeof text,
      "each call of its loop() changes its state, and a robot calls it about %lld times per tick, here once; "
      "let it act by kilo_ticks, or set loop_rate: AS_ON_ROBOT",
      static_cast<long long>(std::max<std::int64_t>(1, std::int64_t{budget} * probe.changed / probe.cycles)));
  warnings_.push_back({share_.first + i, text});
}

/// Calls loop() as often as `cycles` allow. Calls that change nothing are skipped: if a call, or a number of calls, leaves the state
/// as it was, then so do all further ones until something happens to the robot.
Executor::Main BehavioursEngine::run_loops(std::uint32_t i, const Executor& executor, std::int32_t cycles,
                                           Span& span) {
  RobotMemory& memory = memory_[i];
  RobotThread& thread = executor.thread();
  KtRobot& robot = executor.robot();
  const KtExchange& exchange = *span.slot.exchange();
  // Memory must hold the state before the first call.
  if (span.eventful)
    static_cast<void>(memory.copy_out(span.slot, executor.data_octets(), thread));
  else
    memory.set(span.program, span.program.file.table.ticks, executor.ticks());
  std::uint32_t calls = 1;
  // After the first change one call is tried again: most programs act once and settle. A tick that ended within loop() settles so
  // too, at a return of loop(), from which the next tick goes on at little cost.
  bool tried_again = false;
  std::int64_t all_calls = 0;
  for (;;) {
    robot.calls = calls;
    robot.spent = robot.returned = 0;
    const std::uint32_t printed = exchange.log_length;
    Executor::Main main = executor.run_main(cycles, wait_period_[i]);
    if (main.fault != nullptr || robot.returned == 0) {
      if (all_calls >= kManyCalls && robot.spent == 0) note_calls(i, all_calls);
      return main;
    }
    const std::int32_t used = cycles - main.left;
    all_calls += calls;
    cycles = main.left;
    const bool unchanged = calls == 1 && robot.returned == KT_RETURNED_UNCHANGED;
    if (unchanged && compares_unchanged_) {
      ++unchanged_calls_.compared;
      if (!memory.settles(span.program, span.slot, executor.data_octets(), thread)) ++unchanged_calls_.differing;
    }
    if (robot.spent == 0 && exchange.log_length == printed &&
        (unchanged || memory.settles(span.program, span.slot, executor.data_octets(), thread))) {
      span.kept = true;
      if (calls == 1 || used <= 0 || cycles <= 0) {
        if (calls == 1 && cycles > 0) span.call_cycles = used;
        return main;
      }
      // A period of several calls: only its rest at the end of the tick is still to be executed.
      cycles %= used;
      if (cycles == 0) return main;
      span.kept = false;
      calls = 0;
      continue;
    }
    if (cycles <= 0) return main;
    static_cast<void>(memory.copy_out(span.slot, executor.data_octets(), thread));
    if (calls != 0 && calls < 1u << 20 && tried_again) calls *= 2;
    tried_again = true;
  }
}

/// Calls kilo_message_tx. On a robot this interrupts loop() at any place. A program that is not ready to send for a part of each
/// call must be found so as often as that part lasts. If the calls were skipped, one is therefore executed up to a random cycle, and
/// completed after the callback.
const Fault* BehavioursEngine::transmit(std::uint32_t i, const Executor& executor, const Span& span,
                                        const KtMessage*& message, std::int32_t& cycles) {
  if (span.call_cycles <= 0) return executor.transmit(message, cycles);
  KtRobot& robot = executor.robot();
  const auto length = static_cast<std::uint64_t>(span.call_cycles);
  const std::uint64_t bits = random_.bits(Stream::kProgram, share_.first + i, now_, kInterruptedCycle);
  const auto before = static_cast<std::int32_t>((bits >> 32) * length >> 32);
  robot.calls = 1;
  robot.returned = 0;
  const Executor::Main first = executor.run_main(before, 0);
  if (first.fault != nullptr) return first.fault;
  if (const Fault* const fault = executor.transmit(message, cycles)) return fault;
  if (robot.returned != 0) return nullptr;
  const Executor::Main rest = executor.run_main(std::max(span.call_cycles - before + first.left, 0), 0);
  // The callback may have changed what the call does: a delay() in it goes on in the next tick.
  if (rest.left < 0) robot.debt_cycles += static_cast<std::uint64_t>(-rest.left);
  if (rest.preempted) ++robot.waits;
  return rest.fault;
}

/// Notes that in this tick loop() was called so often, and that the last call changed something.
void BehavioursEngine::note_calls(std::uint32_t i, std::int64_t calls) {
  LoopProbe& probe = probes_[plan_.program_of(share_.first + i)];
  if (probe.done >= kProbes || now_.count() < probe.next) return;
  probe.next = now_.count() + kProbePeriod;
  if (++probe.done < kProbes) return;
  char text[208];
  std::snprintf(text, sizeof text,
                "each call of its loop() changes its state, so each is simulated, more than %lld per tick; this "
                "takes time. If only kilo_ticks matters to it, loop_rate: ONCE_PER_TICK is faster",
                static_cast<long long>(calls));
  warnings_.push_back({share_.first + i, text});
}

/// Runs the main program for the rest of the tick.
const Fault* BehavioursEngine::run_main(std::uint32_t i, const Executor& executor, std::int32_t interrupted_cycles,
                                        Span& span) {
  KtRobot& robot = executor.robot();
  const auto tick_cycles = static_cast<std::int32_t>(plan_.tick_length.cycles());
  std::int64_t cycles = tick_cycles;
  const bool as_on_robot = robot.loop_rate == KT_LOOP_AS_ON_ROBOT;
  if (as_on_robot) {
    // Callbacks, transmissions and the cycles by which the last tick was exceeded reduce the budget.
    const std::uint64_t owed = robot.debt_cycles + static_cast<std::uint64_t>(interrupted_cycles);
    const std::uint64_t paid = std::min<std::uint64_t>(owed, static_cast<std::uint64_t>(tick_cycles));
    robot.debt_cycles = owed - paid;
    cycles -= static_cast<std::int64_t>(paid);
    if (cycles <= 0) {
      if (span.eventful) return nullptr;
      memory_[i].set(span.program, span.program.file.table.ticks, executor.ticks());
      span.kept = true;
      return nullptr;
    }
  }
  const Executor::Main main = as_on_robot ? run_loops(i, executor, static_cast<std::int32_t>(cycles), span)
                                          : executor.run_main(static_cast<std::int32_t>(cycles), wait_period_[i]);
  wait_period_[i] = main.wait_period;
  if (main.fault != nullptr) return main.fault;
  if (as_on_robot && main.left < 0) robot.debt_cycles += static_cast<std::uint64_t>(-main.left);
  if (main.preempted) ++robot.waits;
  robot.looped = main.preempted && (executor.thread().check & KT_CHECK_WAITS) == 0 ? 1 : 0;
  const bool endless = main.preempted && (executor.thread().check & KT_CHECK_ENDLESS) != 0;
  robot.stuck_ticks = endless ? static_cast<std::uint16_t>(robot.stuck_ticks + 1) : std::uint16_t{0};
  if (endless && std::int64_t{robot.stuck_ticks} * tick_cycles >= kPatienceCycles)
    return executor.fail({Fault::kEndlessLoop, 0, executor.thread().place});
  return nullptr;
}

/// Sets the sensor readings and the EEPROM of the robot in the slot for this tick.
void BehavioursEngine::set_surroundings(std::uint32_t i, const Slot& slot, std::uint32_t receptions) {
  KtSurroundings& around = *slot.surroundings();
  const senses::Readings readings = senses_.readings(i);
  around.light = readings.light;
  around.light_sd = readings.light_sd;
  around.voltage = readings.voltage;
  around.voltage_sd = readings.voltage_sd;
  around.temperature = readings.temperature;
  around.temperature_sd = readings.temperature_sd;
  around.charging = readings.charging ? 1 : 0;
  around.receiving_cycles = receptions * kPacketCycles;
  around.receiving_from = 0;
  around.eeprom = eeprom_[i] ? eeprom_[i]->data() : nullptr;
  around.eeprom_filled = around.eeprom_written = 0;
  around.led_changes = 0;
  around.motors.count = around.motors.from = 0;
}

void BehavioursEngine::keep_eeprom(std::uint32_t i, const Slot& slot) {
  calibrated_[i] = 0;
  if (eeprom_[i]) return;
  eeprom_[i] = std::make_unique<Eeprom>();
  std::copy_n(slot.surroundings()->eeprom_copy, eeprom_[i]->size(), eeprom_[i]->begin());
}

void BehavioursEngine::reset_robot(Tick tick, std::uint32_t i, const Program& program, const Slot& slot) {
  const std::uint32_t id = share_.first + i;
  const Calibration& calibration = parameters_.calibration(id);
  memory_[i].reset(program, slot);
  auto robot = memory_[i].get<KtRobot>(program, program.file.table.robot);
  robot.noise = random_.bits(Stream::kProgram, id, tick, kNoiseSeed);
  robot.tick_cycles = plan_.tick_length.cycles();
  robot.loop_rate = plan_.loop_rate(id) == LoopRate::kAsOnRobot ? KT_LOOP_AS_ON_ROBOT : KT_LOOP_PER_TICK;
  robot.uid = plan_.uid_of(id);
  robot.turn_left = calibration.turn_left;
  robot.turn_right = calibration.turn_right;
  robot.straight_left = calibration.straight_left;
  robot.straight_right = calibration.straight_right;
  memory_[i].set(program, program.file.table.robot, robot);
  presence_[i] = Presence::kAlive;
  holds_[i] = 0;
}

void BehavioursEngine::fail_robot(std::uint32_t i, const Fault& fault, const Program& program, const Slot& slot) {
  static_cast<void>(slot.clear_before_data());  // for the next robot in the slot
  if (slot.exchange()->heap_full != 0) note_full_heap(i, *slot.exchange(), program, slot);
  fail_robot(i, describe(fault, program, slot));
}

/// Stops robots whose programs crashed their host at this tick in an earlier attempt at this run.
void BehavioursEngine::fail_known_culprits(Tick from) {
  for (const ProgramFailure& failure : plan_.program_failures()) {
    if (failure.tick != from || !share_.contains(failure.robot)) continue;
    const std::uint32_t i = failure.robot - share_.first;
    if (presence_[i] == Presence::kNew || presence_[i] == Presence::kAlive)
      fail_robot(i, "its program crashes its host");
  }
}

void BehavioursEngine::fail_robot(std::uint32_t i, std::string text) {
  failures_.push_back({share_.first + i, std::move(text)});
  presence_[i] = Presence::kFailed;
  life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kFailed);
  motor_left_[i] = motor_right_[i] = spin_up_[i] = 0;
  holds_[i] = offers_[i] = 0;
  memory_[i].release();
}

void BehavioursEngine::take_log(std::uint32_t i, const Slot& slot) {
  KtExchange& exchange = *slot.exchange();
  // The robot may have overwritten the exchange, so limit its length.
  const std::uint32_t length = std::min<std::uint32_t>(exchange.log_length, KT_LOG_OCTETS);
  printed_.push_back({share_.first + i, std::string(exchange.log, length)});
  if (exchange.log_lost != 0)
    printed_.back().text += "... (" + std::to_string(exchange.log_lost) + " more octets)\n";
  exchange.log_length = exchange.log_lost = 0;
}

/// The duties to show for the tick, and how long both were full in it. A spin-up that goes on shows the duties before it.
void BehavioursEngine::note_motors(std::uint32_t i, KtRobot& robot, KilotwinMotorPhases& phases) {
  const std::int64_t tick_cycles = plan_.tick_length.cycles();
  std::uint8_t left = robot.duty_left, right = robot.duty_right;
  std::int64_t full_cycles = robot.full_cycles;
  if (robot.full != 0) {
    const std::int64_t since = std::max<std::int64_t>(tick_cycles - robot.full_from, 0);
    if (left == 255 && right == 255) {
      full_cycles += since;
      if (full_cycles < tick_cycles) {
        left = robot.before_left;
        right = robot.before_right;
      } else {
        full_cycles = 0;
      }
    } else {  // the program has ended it by a register
      full_cycles += std::min(since, kSpinUpCycles);
      robot.full = 0;
    }
  }
  robot.full_from = robot.full_cycles = 0;
  if (phases.count != 0) {
    phases.count = std::min(phases.count, KILOTWIN_MOTOR_PAIRS);  // the robot may have overwritten it
    const auto since = static_cast<std::uint32_t>(std::max<std::int64_t>(tick_cycles - phases.from, 0));
    kilotwin_add_motors(&phases, robot.duty_left, robot.duty_right, since);
    const MotorShare::Pair shown = motor_share_[i].choose(phases);
    left = shown.left;
    right = shown.right;
  }
  const bool on = robot.motors_on != 0;
  motor_left_[i] = on ? left : std::uint8_t{0};
  motor_right_[i] = on ? right : std::uint8_t{0};
  spin_up_[i] = on && full_cycles > 0 ? spin_up_of(full_cycles, tick_cycles) : std::uint8_t{0};
}

void BehavioursEngine::note_outputs(std::uint32_t i, KtRobot& robot, const Slot& slot, std::uint16_t tx_period) {
  note_motors(i, robot, slot.surroundings()->motors);
  led_[i] = robot.led & 63;
  // A sleeping robot that has woken up to listen is idle for the radio.
  const bool listens = robot.state == static_cast<std::uint8_t>(LifeCycle::kSleeping) && robot.deaf == 0;
  life_cycle_[i] = listens ? static_cast<std::uint8_t>(LifeCycle::kIdle) : robot.state;
  tx_period_[i] = tx_period;
}

bool BehavioursEngine::read(std::uint32_t robot, std::uint64_t offset, std::span<std::uint8_t> to) const {
  const std::uint32_t i = robot - share_.first;
  if (presence_[i] != Presence::kNew && presence_[i] != Presence::kAlive) return false;
  const Program& program = programs_->program(plan_.program_of(robot));
  // A robot that has not run yet has the variables of its program's start.
  const std::span<const std::uint8_t> data =
      presence_[i] == Presence::kNew ? std::span(program.slot(robot % kSlots).initial_data()) : memory_[i].data();
  const std::uint64_t first = program.file.data.first;
  if (offset < first || offset - first > data.size() || to.size() > data.size() - (offset - first)) return false;
  std::memcpy(to.data(), data.data() + (offset - first), to.size());
  return true;
}

bool BehavioursEngine::write(std::uint32_t robot, std::uint64_t offset, std::span<const std::uint8_t> octets) {
  const std::uint32_t i = robot - share_.first;
  if (presence_[i] != Presence::kNew && presence_[i] != Presence::kAlive) return false;
  const Program& program = programs_->program(plan_.program_of(robot));
  // As the next step would.
  if (presence_[i] == Presence::kNew) reset_robot(now_, i, program, program.slot(robot % kSlots));
  const std::span<std::uint8_t> data = memory_[i].data();
  const std::uint64_t first = program.file.data.first;
  if (offset < first || offset - first > data.size() || octets.size() > data.size() - (offset - first))
    return false;
  std::memcpy(data.data() + (offset - first), octets.data(), octets.size());
  return true;
}

std::uint64_t BehavioursEngine::offset_of(std::uint32_t robot, std::uint64_t pointer) const {
  return pointer - programs_->program(plan_.program_of(robot)).slot(robot % kSlots).image_address();
}

void BehavioursEngine::emit(ActuationFrame& frame) const {
  frame.tick = now_;
  frame.first_robot = share_.first;
  frame.motor_left = motor_left_;
  frame.motor_right = motor_right_;
  frame.spin_up = spin_up_;
  frame.led = led_;
  frame.life_cycle = life_cycle_;
  frame.tx_period = tx_period_;
  frame.offer_robot.clear();
  frame.offer_message.clear();
  frame.offer_crc_error.clear();
  std::uint16_t any_error = 0;
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    if (offers_[i] == 0) continue;
    frame.offer_robot.push_back(share_.first + i);
    frame.offer_message.push_back(message_[i]);
    frame.offer_crc_error.push_back(crc_error_[i]);
    any_error |= crc_error_[i];
  }
  if (any_error == 0) frame.offer_crc_error.clear();
}

namespace {

/// For the hash: 0, 1 for one whole spin-up, else the value from bit 2 on.
std::uint64_t spin_up_word(std::uint8_t spin_up) {
  if (spin_up == 0 || spin_up == kOneSpinUp) return spin_up != 0 ? 1 : 0;
  return std::uint64_t{spin_up} << 2;
}

}  // namespace

std::uint64_t BehavioursEngine::hash_part() const {
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    // A robot without a program has nothing of its own here, unless it says something or is absent.
    constexpr auto kIdle = static_cast<std::uint8_t>(LifeCycle::kIdle);
    if (presence_[i] == Presence::kNone && life_cycle_[i] == kIdle && led_[i] == 0) continue;
    const std::uint64_t outputs = motor_left_[i] | std::uint64_t{motor_right_[i]} << 8 |
                                  std::uint64_t{led_[i]} << 16 | std::uint64_t{life_cycle_[i]} << 24 |
                                  std::uint64_t{tx_period_[i]} << 32 | std::uint64_t{holds_[i]} << 48 |
                                  spin_up_word(spin_up_[i]) << 49 | std::uint64_t{is_due_[i]} << 50;
    if (senses_.has_batteries()) {
      const auto charge = static_cast<std::uint64_t>(senses_.charge(i));
      sum += entity_hash(HashDomain::kProgram, share_.first + i, {outputs, charge});
    } else {
      sum += entity_hash(HashDomain::kProgram, share_.first + i, {outputs});
    }
  }
  return sum;
}

std::uint64_t BehavioursEngine::memory_octets() const {
  std::uint64_t sum = 0;
  for (const RobotMemory& memory : memory_) sum += memory.data().size() + memory.stack().size();
  return sum;
}

}  // namespace kilotwin::behaviours

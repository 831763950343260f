/// The robots' programs of one host: messages and time in; motors, LEDs and messages out.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/eeprom_layout.h"
#include "core/frames/swarm_view.hpp"
#include "core/model/radio_parameters.hpp"
#include "core/model/robot_parameters.hpp"
#include "core/plan/plan.hpp"
#include "core/random/random.hpp"
#include "core/senses/robot_senses.hpp"
#include "services/behaviours/executor.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::proto {
class BehavioursState;
}

namespace kilotwin::behaviours {

/// In step k, for each robot in this order: its clock advances; kilo_message_tx_success if its message has left; receptions
/// in order of arrival; the main program until it has used up the tick; kilo_message_tx if it is asked, runs, and holds no
/// message. A message is held until it has left or the robot stops running.
/// Robots that run firmware have it in the radio; their motors and LEDs are passed on from its frame.
/// Robots of tracked groups have no program: motors 0, LED 0, life cycle IDLE.
/// A sleeping robot wakes every 8 s to listen and shows as IDLE meanwhile. One whose battery is flat shows as FLAT, and
/// starts anew once it is charged.
/// Pure, but for robots' code that faults: that stops its robot and is noted. Engines of one process may step in parallel.
class BehavioursEngine {
 public:
  using Eeprom = std::array<std::uint8_t, KILOTWIN_EEPROM_OCTETS>;

  /// State at tick 0. `programs` are those of the plan's manifest.
  BehavioursEngine(const RunPlan& plan, HostId host, std::shared_ptr<ProgramSet> programs);

  /// From tick `from` to the next. The radio's frame for this host is of tick `from`, and so is the swarm, which is needed
  /// where RunPlan::hosts_see_bodies().
  void step(Tick from, const RadioFrame& radio, const SwarmView* swarm = nullptr);
  void emit(ActuationFrame& frame) const;
  /// Sum of entity_hash over own robots: motors, LED, life cycle, tx period, whether a message is held;
  /// where there are batteries, their charge.
  [[nodiscard]] std::uint64_t hash_part() const;

  void save(proto::BehavioursState& state) const;
  /// Takes own robots out of all parts of a checkpoint of tick `tick`. Throws RunError where a robot is missing or does not
  /// fit its program.
  void load(Tick tick, std::span<const proto::BehavioursState* const> parts);

  struct Failure {
    std::uint32_t robot = 0;
    std::string text;  ///< one line: what its program did
  };
  /// Robots whose program has faulted: new ones are appended.
  [[nodiscard]] const std::vector<Failure>& failures() const { return failures_; }
  [[nodiscard]] std::uint32_t robots_failed() const { return static_cast<std::uint32_t>(failures_.size()); }

  struct Printed {
    std::uint32_t robot = 0;
    std::string text;
  };
  /// What robots printed in the last step, in the order in which they ran. Not part of their state.
  [[nodiscard]] const std::vector<Printed>& printed() const { return printed_; }

  /// What robots' programs do that goes on, but is hardly meant: new ones are appended, one per program and kind.
  [[nodiscard]] const std::vector<Failure>& warnings() const { return warnings_; }

  /// Whose code runs at this moment. May be read from any thread, or process, while the engine steps.
  struct Running {
    std::atomic<std::uint32_t> robot{kNobody};
    std::atomic<std::uint64_t> entry{0};  ///< robots entered since the start: the same number, the same call
    std::atomic<std::int64_t> tick{0};    ///< of the step
  };
  static constexpr std::uint32_t kNobody = 0xffffffffu;
  [[nodiscard]] const Running& running() const { return *running_; }
  /// Notes it there instead, in memory that outlives this process, say.
  void note_running_in(Running& place) { running_ = &place; }

  /// What robot `id`, one of this host's, has in its EEPROM; nullptr where that is what calibration has left.
  [[nodiscard]] const Eeprom* eeprom(std::uint32_t id) const {
    const std::uint32_t i = id - share_.first;
    return calibrated_[i] != 0 ? nullptr : eeprom_[i].get();
  }

  /// Octets of memory that robots' programs take at present.
  [[nodiscard]] std::uint64_t memory_octets() const;

 private:
  enum class Presence : std::uint8_t { kNone, kNew, kAlive, kFailed, kFirmware };

  void gather(const RadioFrame& radio);
  void relay_firmware(const RadioFrame& radio);
  void run_robot(Tick from, std::uint32_t i, std::uint8_t kilo_ticks, const Program&, const Slot&, const Executor&);
  void use_battery(std::uint32_t i);
  void surround(std::uint32_t i, const Slot&, std::uint32_t receptions);
  void calibrate_ranging(const RadioParameters&);
  void keep_eeprom(std::uint32_t i, const Slot&);
  const Fault* run_main(std::uint32_t i, const Executor&, std::int32_t interrupted_cycles);
  void note_division(std::uint32_t i, std::uint64_t code, const Program&, const Slot&);
  void reset_robot(Tick tick, std::uint32_t i, const Program&, const Slot&);
  void fail_robot(std::uint32_t i, const Fault&, const Program&, const Slot&);
  void fail_robot(std::uint32_t i, std::string text);
  void fail_known_culprits(Tick from);
  void take_log(std::uint32_t i, const Slot&);
  void note_outputs(std::uint32_t i, const KtRobot& robot, std::uint16_t tx_period);

  const RunPlan& plan_;
  const HostId host_;
  const Share share_;
  const Random random_;
  const RobotParameters parameters_;
  const std::shared_ptr<ProgramSet> programs_;

  Tick now_;

  /// Own robots by slot and program: the order in which they run.
  struct Group {
    std::uint32_t program = 0, slot = 0;
    std::vector<std::uint32_t> robots;  ///< indices below, ascending
  };
  std::vector<Group> groups_;

  // Per own robot; index i is robot share_.first + i.
  senses::RobotSenses senses_;
  std::vector<RobotMemory> memory_;
  std::vector<std::uint8_t> calibrated_;         ///< 1: its EEPROM is what calibration has left
  std::vector<std::unique_ptr<Eeprom>> eeprom_;  ///< of those that have written to it, or have one of their own
  std::vector<Presence> presence_;
  std::vector<std::uint8_t> motor_left_, motor_right_, spin_up_, led_, life_cycle_;
  std::vector<std::uint16_t> tx_period_;
  std::vector<std::uint8_t> holds_;   ///< a message that has not left
  std::vector<std::uint8_t> offers_;  ///< a message that is new in this tick
  std::vector<IrMessage> message_;    ///< where it offers one

  std::vector<Failure> failures_, warnings_;
  std::vector<Printed> printed_;

  // Of the step at hand; per own robot where not said otherwise.
  std::vector<std::uint8_t> asked_, sent_;
  std::vector<std::uint32_t> first_reception_;  ///< one more than robots
  std::vector<KtReception> receptions_;         ///< ordered by robot, then by time of arrival
  std::vector<KtMessage> messages_;             ///< with their checksums

  // Nothing that a result depends on.
  std::vector<std::int32_t> spins_;    ///< per own robot: Executor::Main::spins of the last tick
  std::vector<std::uint8_t> divided_;  ///< per program: a division by zero was told

  Running own_running_;
  Running* running_ = &own_running_;
};

}  // namespace kilotwin::behaviours

/// The behaviours engine: it runs the robots' programs of one host. Inputs are messages, clocks and readings of sensors; outputs are
/// motors, LEDs and messages.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/base/eeprom_layout.h"
#include "core/base/motor_share.hpp"
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

/// Inputs about tracked robots from the station and the schedule; needed where RunPlan::any_tracked().
struct TrackedInputs {
  const TrackingFrame* frame = nullptr;
  std::span<const MembershipChange> memberships{};  ///< that take effect in the step, in order
};

/// A step does for each robot, in this order:
///   1. advance the robot's clock;
///   2. call kilo_message_tx_success if its message has been sent;
///   3. call kilo_message_rx for each reception, in order of arrival;
///   4. run the main program until it has used up the tick;
///   5. call kilo_message_tx if the radio requests a message, the robot is running, and it holds no message.
/// A robot holds a message until it is sent or the robot stops running.
///
/// The radio runs the processors of firmware robots; this engine copies their motors and LEDs from the radio's frame.
/// Robots of tracked groups show the LED that a tracker saw. Without a program they are IDLE, or RUNNING while a rule says
/// something for them, or if they say what listeners hear of them. With one, their shadow, they have its life cycle; its motors
/// are shown and move nothing. A robot that is absent runs no program and is ABSENT. A sleeping robot wakes every 8 s to listen and meanwhile has
/// the life cycle IDLE. A robot with a flat battery has the life cycle FLAT and restarts once it is charged.
///
/// The engine is a pure function of its inputs. A fault in a robot's code stops that robot and adds a Failure. Engines of one
/// process may step in parallel.
class BehavioursEngine {
 public:
  using Eeprom = std::array<std::uint8_t, KILOTWIN_EEPROM_OCTETS>;

  /// The state at tick 0. `programs` must be loaded from the plan's run directory.
  BehavioursEngine(const RunPlan& plan, HostId host, std::shared_ptr<ProgramSet> programs);

  /// Steps from tick `from` to the next. `radio` is the frame for this host at tick `from`. `swarm` is at tick `from` too; it may
  /// be null unless RunPlan::hosts_see_bodies().
  void step(Tick from, const RadioFrame& radio, const SwarmView* swarm = nullptr,
            const TrackedInputs& tracked = {});
  void emit(ActuationFrame& frame) const;
  /// Sum of entity_hash over the host's robots. It covers motors, LED, life cycle, transmission period, whether a message is held,
  /// and the charge if the experiment has batteries.
  [[nodiscard]] std::uint64_t hash_part() const;

  void save(proto::BehavioursState& state) const;
  /// Loads the host's robots from the parts of a checkpoint at tick `tick`. Throws RunError if a robot is missing or its state does
  /// not fit its program.
  void load(Tick tick, std::span<const proto::BehavioursState* const> parts);

  struct Failure {
    std::uint32_t robot = 0;
    std::string text;  ///< one line about the program's fault
  };
  /// Robots whose program has faulted, in order of time.
  [[nodiscard]] const std::vector<Failure>& failures() const { return failures_; }
  [[nodiscard]] std::uint32_t robots_failed() const { return static_cast<std::uint32_t>(failures_.size()); }

  struct Printed {
    std::uint32_t robot = 0;
    std::string text;
  };
  /// Text that robots printed in the last step, in the order in which they ran. Not part of the state.
  [[nodiscard]] const std::vector<Printed>& printed() const { return printed_; }

  /// Divisions by zero, messages with a wrong CRC, ends of main() and a loop() whose number of calls matters, the first of each
  /// kind of each program; overflows of an int, the first of each line. In order of time. The programs go on running.
  [[nodiscard]] const std::vector<Failure>& warnings() const { return warnings_; }

  /// The robot whose code is running. Any thread or process may read it while the engine steps.
  struct Running {
    std::atomic<std::uint32_t> robot{kNobody};
    std::atomic<std::uint64_t> entry{0};  ///< count of calls into robots' code; an equal count means the same call
    std::atomic<std::int64_t> tick{0};    ///< tick from which the engine steps
  };
  static constexpr std::uint32_t kNobody = 0xffffffffu;
  [[nodiscard]] const Running& running() const { return *running_; }
  /// Uses `place` in place of the engine's own Running, e.g. in a mapped file, which survives a crash of this process.
  void note_running_in(Running& place) { running_ = &place; }

  /// The EEPROM of robot `id` of this host, or nullptr if it holds only the calibration.
  [[nodiscard]] const Eeprom* eeprom(std::uint32_t id) const {
    const std::uint32_t i = id - share_.first;
    return calibrated_[i] != 0 ? nullptr : eeprom_[i].get();
  }

  /// Copies octets of a robot's variables, for the recording. `offset`: as in ElfFile. Returns false where the robot runs no
  /// program here, has failed, or has no variables there.
  [[nodiscard]] bool read(std::uint32_t robot, std::uint64_t offset, std::span<std::uint8_t> to) const;
  /// Changes a robot's variables between two steps, as a debugger would: no program and no message does so. Returns false where
  /// read() does.
  [[nodiscard]] bool write(std::uint32_t robot, std::uint64_t offset, std::span<const std::uint8_t> octets);
  /// The offset to which a pointer in a robot's memory points.
  [[nodiscard]] std::uint64_t offset_of(std::uint32_t robot, std::uint64_t pointer) const;

  /// Voltage of the battery of robot `id` of this host, V. Requires that the experiment has batteries.
  [[nodiscard]] double battery_V(std::uint32_t id) const { return senses_.battery_V(id - share_.first); }

  /// Calls of loop() after which a program said that it had written nothing.
  struct UnchangedCalls {
    std::uint64_t compared = 0, differing = 0;
  };
  /// From now on compares the memory after each such call, which is otherwise trusted. For tests; results stay as they are.
  void compare_unchanged_calls() { compares_unchanged_ = true; }
  [[nodiscard]] const UnchangedCalls& unchanged_calls() const { return unchanged_calls_; }

  /// Octets that the memories of all robots occupy.
  [[nodiscard]] std::uint64_t memory_octets() const;

 private:
  enum class Warning : std::uint8_t { kDivision = 1, kWrongCrc = 2, kEnded = 4, kHeapFull = 8 };
  enum class Presence : std::uint8_t { kNone, kNew, kAlive, kFailed, kFirmware };

  void gather(const RadioFrame& radio);
  void relay_firmware(const RadioFrame& radio);
  void take_memberships(const TrackedInputs& tracked);
  void follow(const TrackingFrame& frame);
  void say_by_rule(std::uint32_t i, const Pose& p_WR);
  void say_what_was_heard();
  void run_robot(Tick from, std::uint32_t i, std::uint8_t kilo_ticks, const Program&, const Slot&, const Executor&);
  void use_battery(std::uint32_t i);
  void calibrate_ranging(const RadioParameters&);
  void keep_eeprom(std::uint32_t i, const Slot&);
  struct Span;
  // The path of a robot through its tick, in line: calls of these would take as long as their work.
  [[gnu::always_inline]] inline void set_surroundings(std::uint32_t i, const Slot&, std::uint32_t receptions);
  [[gnu::always_inline]] inline const Fault* run_main(std::uint32_t i, const Executor&,
                                                      std::int32_t interrupted_cycles, Span&);
  [[gnu::always_inline]] inline Executor::Main run_loops(std::uint32_t i, const Executor&, std::int32_t cycles,
                                                         Span&);
  [[gnu::always_inline]] inline void note_outputs(std::uint32_t i, KtRobot& robot, const Slot&,
                                                  std::uint16_t tx_period);
  [[gnu::always_inline]] inline void note_motors(std::uint32_t i, KtRobot& robot, KilotwinMotorPhases&);
  const Fault* transmit(std::uint32_t i, const Executor&, const Span&, const KtMessage*& message,
                        std::int32_t& cycles);
  [[nodiscard]] bool is_first(std::uint32_t i, Warning);
  void probe_loop(std::uint32_t i, const Program&, const Slot&, const Executor&);
  void note_overflows(std::uint32_t i, KtExchange&, const Program&, const Slot&);
  void note_full_heap(std::uint32_t i, KtExchange& told, const Program& program, const Slot& slot);
  void note_wrong_crc(std::uint32_t i, std::uint16_t crc);
  void note_division(std::uint32_t i, std::uint64_t code, const Program&, const Slot&);
  void reset_robot(Tick tick, std::uint32_t i, const Program&, const Slot&);
  void fail_robot(std::uint32_t i, const Fault&, const Program&, const Slot&);
  void fail_robot(std::uint32_t i, std::string text);
  void fail_known_culprits(Tick from);
  void take_log(std::uint32_t i, const Slot&);
  void note_calls(std::uint32_t i, std::int64_t calls);

  const RunPlan& plan_;
  const HostId host_;
  const Share share_;
  const Random random_;
  const RobotParameters parameters_;
  const std::shared_ptr<ProgramSet> programs_;

  Tick now_;

  /// Robots with the same program and slot. Groups run one after the other.
  struct Group {
    std::uint32_t program = 0, slot = 0;
    std::vector<std::uint32_t> robots;  ///< ascending indices into the vectors below
  };
  std::vector<Group> groups_;

  // Per robot of the host; index i is robot share_.first + i.
  senses::RobotSenses senses_;
  std::vector<RobotMemory> memory_;
  std::vector<std::uint8_t> calibrated_;         ///< 1: the EEPROM holds only the calibration
  std::vector<std::unique_ptr<Eeprom>> eeprom_;  ///< null: the default content, uid and motor calibration
  std::vector<Presence> presence_;
  std::vector<std::uint8_t> motor_left_, motor_right_, spin_up_, led_, life_cycle_;
  std::vector<MotorShare> motor_share_;
  std::vector<std::uint8_t> absent_;    ///< 1: a tracked robot that is not there
  std::vector<std::uint8_t> seen_led_;  ///< of tracked robots, or kUnknownLed
  std::vector<std::uint16_t> tx_period_;
  std::vector<std::uint8_t> holds_;       ///< 1: the robot holds a message that is not sent yet
  std::vector<std::uint8_t> offers_;      ///< 1: the robot offers a further message in this tick
  std::vector<IrMessage> message_;        ///< the offered message; valid if offers_
  std::vector<std::uint16_t> crc_error_;  ///< of the offered message: its CRC XOR the right one
  // Of tracked robots that say what listeners heard of them.
  std::vector<std::uint8_t> is_due_;  ///< 1: a message that was heard waits to be offered
  std::vector<IrMessage> due_;        ///< that message; valid if is_due_

  std::vector<Failure> failures_, warnings_;
  std::vector<Printed> printed_;

  // Inputs of the current step.
  std::vector<std::uint8_t> requested_,
      sent_;  ///< per robot: the radio requests a message; its message has been sent
  std::vector<std::uint32_t> first_reception_;  ///< per robot, plus one: index into receptions_
  std::vector<KtReception> receptions_;         ///< ordered by robot, then by time of arrival
  std::vector<KtMessage> messages_;             ///< of receptions_, with checksums
  bool wrong_crc_ = false;                      ///< one of messages_ has a wrong checksum

  // No result depends on these.
  std::vector<std::int32_t> wait_period_;  ///< per robot: Executor::Main::wait_period of the last tick
  std::set<std::string> overflows_;        ///< lines of which was said that an int overflows
  std::set<std::pair<std::uint32_t, std::uint64_t>> overflown_;  ///< their programs and places in the code
  struct LoopProbe {
    std::int64_t next = 0;  ///< tick of the next probe
    std::uint32_t done = 0, changed = 0;
    std::int64_t cycles = 0;  ///< of the calls that changed something
  };
  std::vector<LoopProbe> probes_;     ///< per program: whether a further call of loop() in a tick changes its state
  std::vector<std::uint8_t> warned_;  ///< per program: Warning bits of what was reported
  bool compares_unchanged_ = false;
  UnchangedCalls unchanged_calls_;

  Running own_running_;
  Running* running_ = &own_running_;
};

}  // namespace kilotwin::behaviours

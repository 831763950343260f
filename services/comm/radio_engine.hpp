/// The infrared channel of the swarm: the robots' clocks, when each of them sends, and who receives what.
///
/// step from tick k simulates [k, k+1), to the cycle, with the frames of tick k:
///   poses, life cycles and tx_periods are read; offers fill empty slots; the overhead controller takes its packets
///   contend : in the order of time, every robot that holds a message tries to send at its timer's interrupts
///   arrive  : packets that end in the interval are received by the robots in range of their sender
///
/// Sending. At an interrupt of its timer a robot that is RUNNING, holds a message and whose tx_clock exceeds its tx_period
/// tries to send. If it hears a packet, from its start pulse on, it waits for its next interrupt. Else its own start pulse
/// goes out. For two bits it hears nothing; another start pulse that it hears in the rest of the leading byte (of somebody
/// who does not hear it) makes it give up, and its timer interrupts it once more after a random time (back-off). A packet
/// that goes on to its end is a success: tx_clock starts again and the host is told.
///
/// Receiving. A packet is received at every robot that hears its sender (link_budget.hpp) unless anything else that is heard
/// there overlaps it in time: another packet, an aborted packet's start pulse, a copy of the overhead controller, the
/// receiver's own sending. Then all of them are lost there, but for one that is stronger than the others by capture_db. Robots that are SLEEPING or FAILED, or whose bodies are
/// real, receive nothing.
///
/// The slot. A robot's message lies in its host's slot and here from its offer until success. Both sides empty it when the
/// robot is not RUNNING; what is on the air then goes to its end unreported.
///
/// With `model: SIMPLE` there is none of this (simple_radio.cpp): it is the seed's model, for comparison.
///
/// Robots that run real firmware do all this themselves, bit by bit: firmware_air.hpp. What they send takes part in the
/// above as transmissions do.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/frames/radio_counts.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/model/ranging.hpp"
#include "core/plan/plan.hpp"
#include "core/plan/radio_settings.hpp"
#include "core/random/random.hpp"
#include "services/comm/channel.hpp"
#include "services/comm/firmware_air.hpp"
#include "services/comm/link_budget.hpp"
#include "services/comm/link_table.hpp"
#include "services/comm/neighbourhood.hpp"
#include "services/comm/overhead_controller.hpp"
#include "services/comm/pair_counts.hpp"
#include "services/comm/reception_log.hpp"
#include "services/comm/region.hpp"
#include "services/comm/tick_timers.hpp"

namespace kilotwin::proto {
class RadioState;
}

namespace kilotwin::comm {

class RadioEngine {
 public:
  /// What a step from tick k reads; all of it is of tick k.
  struct Inputs {
    const SwarmView& swarm;
    const OverheadFrame& overhead;
    /// Of every other region, what it emits for this one; none where the region is everywhere.
    std::span<const RadioGhosts* const> ghosts = {};
  };

  /// Messages of robots since the start. attempted = sent + aborted + those on the air. Over all packets sent and all
  /// robots that could receive them: received + collided + faded. The overhead controller's copies do not count.
  struct Counters {
    std::uint64_t attempted = 0;  ///< start pulses
    std::uint64_t sent = 0;       ///< whole packets
    std::uint64_t received = 0;
    std::uint64_t collided = 0;  ///< receptions lost because something overlapped
    std::uint64_t aborted = 0;   ///< given up in the leading byte
    std::uint64_t faded = 0;     ///< receptions lost by radio.loss
  };

  /// `firmware`: the robots of the plan that run firmware, at tick 0; needed where there are any.
  /// `region`: whose robots are this engine's own; frames and counts are of them alone, so that those of all regions add up to
  /// those of one engine. Where it is not everywhere: without firmware robots, save and load.
  explicit RadioEngine(const RunPlan&, std::unique_ptr<FirmwareRobots> firmware = nullptr, Region region = {});
  RadioEngine(const RadioEngine&) = delete;
  RadioEngine& operator=(const RadioEngine&) = delete;

  /// Advances from tick `from`, which must be the present one, to `from` + 1.
  void step(Tick from, const Inputs&);
  /// The frame of the present tick for one host.
  void emit(HostId, RadioFrame&) const;
  /// What the engine of another region needs of this one at the present tick.
  void emit_ghosts(const Region& to, RadioGhosts&) const;
  /// Robots this far from a region matter to it.
  [[nodiscard]] double ghost_margin_mm() const;
  [[nodiscard]] std::uint64_t hash_part() const;
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Per robot.
  [[nodiscard]] const std::vector<RadioCount>& radio_counts() const { return radio_counts_; }
  /// By receiver, then sender; receiver == sender: its own successes. Empty unless recording.messages.
  [[nodiscard]] std::vector<PairCount> pair_counts() const { return pairs_.all(); }

  void save(proto::RadioState&) const;
  /// Continues from what was saved at `tick`. Throws RunError where it does not fit the plan.
  void load(Tick tick, std::span<const proto::RadioState* const> parts);

 private:
  // What a robot's state is made of.
  static constexpr std::uint8_t kRunning = 1;    ///< its life cycle is RUNNING
  static constexpr std::uint8_t kReceptive = 2;  ///< it can receive
  static constexpr std::uint8_t kHolding = 4;    ///< its slot holds a message
  static constexpr std::uint8_t kFlying = 8;     ///< it is sending
  static constexpr std::uint8_t kFirmware = 16;  ///< it runs firmware, and that listens

  struct Attempt {
    Cycles time;
    std::uint32_t robot;
  };
  static bool later(const Attempt& a, const Attempt& b);
  struct Arrival {
    Cycles end;
    std::uint32_t sender;  ///< kOverhead: a copy
    std::uint32_t index;   ///< of the transmission, or of the copy
  };
  static constexpr std::uint32_t kOverhead = 0xffffffffu;

  [[nodiscard]] bool is(std::uint32_t robot, std::uint8_t bits) const { return (state_[robot] & bits) == bits; }
  [[nodiscard]] Cycles begin_of(Tick tick) const { return tick.count() * cycles_per_tick_; }

  [[nodiscard]] bool owns(std::uint32_t robot) const { return !divided_ || owned_[robot] != 0; }

  void take_ghosts(std::span<const RadioGhosts* const>);
  void divide();
  void read_poses(const SwarmView&);
  void read_life_cycles(const SwarmView&);
  void take_offers(const SwarmView&);
  void drop_message(std::uint32_t robot);
  void forget(Cycles begin);

  void contend(Tick now, const SwarmView&);
  void contend_until(Cycles end, Tick now);
  [[nodiscard]] Cycles next_meeting(Cycles end) const;
  void run_firmware(Cycles from, Cycles until, Tick now);
  void abort_who_notices(std::uint32_t robot, Cycles t, Tick now);
  void schedule(std::uint32_t robot, Cycles end);
  void attempt(std::uint32_t robot, Tick now);
  [[nodiscard]] bool senses(std::uint32_t robot, Cycles t);
  void abort(Transmission&, Cycles t, Tick now);

  void exchange_simply(Tick now);
  void receive_simply(std::uint32_t sender, Tick now);
  void arrive(Tick now);
  void finish(std::uint32_t transmission, Cycles end);
  void receive_packet(const Transmission&, Tick now);
  void receive_copy(const OverheadController::Copy&, std::uint32_t ordinal, Tick now);
  void emit_firmware(Share, RadioFrame&) const;
  void receive_in_range(const Transmission&, bool drowned, Tick now);
  void receive_by_strength(const Transmission&, bool drowned, Tick now);
  template <class Readings>
  void take(const Transmission&, std::uint32_t receiver, bool spoilt, Tick now, Readings readings);
  [[nodiscard]] bool fades(std::uint32_t receiver, Tick now, std::uint32_t draw) const;

  const Region region_;
  const bool divided_;               ///< the region is not everywhere
  const std::vector<Share> shares_;  ///< per host
  const Cycles cycles_per_tick_;
  const double loss_;
  const bool counts_pairs_;
  const Random random_;
  const bool simple_;  ///< no packets in time: exchange_simply()
  const SimpleRadioSettings simple_model_;
  const Ranging ranging_;
  const Gains overhead_gains_;

  Tick tick_;
  TickTimers timers_;
  std::vector<std::uint8_t> state_, apart_;  ///< per robot; apart: it runs firmware, or its body is real
  std::vector<std::uint8_t> owned_,
      known_;                             ///< per robot, of a divided channel: this engine's own; that, or a ghost
  std::vector<std::uint16_t> tx_period_;  ///< per robot
  std::vector<IrMessage> message_;        ///< per robot: what its slot holds
  std::vector<Cycles> next_send_;         ///< per robot of a simple radio: when it may send again
  LinkBudget links_;
  Neighbourhood neighbourhood_;
  LinkTable table_;
  Channel channel_;
  OverheadController overhead_;
  std::vector<std::uint32_t> sent_;  ///< in the last tick, ascending
  ReceptionLog receptions_;          ///< of the last tick
  Counters counters_;
  std::vector<RadioCount> radio_counts_;  ///< per robot
  PairCounts pairs_;

  const std::unique_ptr<FirmwareRobots> firmware_robots_;
  std::optional<FirmwareAir> firmware_;  ///< where there are firmware robots

  // Within a step.
  std::size_t next_copy_ = 0;      ///< of the overhead controller, whose start pulse is to come
  Cycles simulated_ = 0;           ///< firmware robots have run so far
  std::vector<Attempt> attempts_;  ///< a heap, earliest first
  std::vector<Arrival> arrivals_;
  std::vector<std::uint32_t> rivals_;
  /// Per robot, in the packet at hand: the strongest of the rivals that it notices, dB.
  struct Rival {
    std::uint32_t packet = 0;  ///< by packets_
    float margin_db = 0;
  };
  std::vector<Rival> strongest_rival_;
  std::uint32_t packets_ = 0;  ///< received so far
  std::vector<std::uint8_t> jammed_;
};

}  // namespace kilotwin::comm

/// The infrared channel of the swarm: the robots' clocks, their attempts to send, and receptions.
///
/// A step from tick k simulates [k, k+1) to the cycle, with the frames of tick k:
///   read poses, life cycles and tx_periods; put offers into empty slots; the overhead controller takes its packets
///   contend : in order of time, every robot with a message attempts to send at its timer's interrupts
///   arrive  : packets that end in the interval reach the robots in range of their sender
///
/// Sending. A robot attempts to send at an interrupt of its timer if it is RUNNING, its slot holds a message, and its tx_clock
/// exceeds its tx_period. If carrier sense detects a packet, it waits for its next interrupt. Otherwise it sends its start
/// pulse. It is deaf for two bits. If it then detects another start pulse in the rest of the leading octet, it gives up, and
/// its timer interrupts it once more after a random time (back-off). Such a pulse is of a robot that does not hear it. A
/// packet that reaches its end is a success: tx_clock restarts, and the host is notified.
///
/// Receiving. Every robot that hears the sender (link_budget.hpp) receives a packet, unless another signal that it hears
/// overlaps in time: another packet, the start pulse of an aborted packet, a packet of the overhead controller, or its own
/// transmission. Then all overlapping packets are lost there, except one that is stronger than all others by capture_db.
/// Robots that are SLEEPING or FAILED receive nothing. Neither do real robots.
///
/// The slot. From the offer until success, a robot's message is in its host's slot and in the slot here. Both sides empty
/// it when the robot leaves RUNNING. A packet on the air then continues to its end and is not reported.
///
/// `model: SIMPLE` is the model of the ARGoS paper, for comparison, without packets in time: simple_radio.cpp.
///
/// Robots with real firmware do all this themselves, bit by bit: firmware_air.hpp. Their packets take part in the channel as
/// transmissions.
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

/// A message for the recording.
struct MessageEvent {
  Cycles time = 0;  ///< the packet's end
  std::uint32_t sender = 0;
  std::uint32_t receiver = 0;  ///< the sender itself: it has sent the whole packet
  float distance_mm = 0;       ///< from sender to receiver
};

class RadioEngine {
 public:
  /// Inputs of a step from tick k; all are of tick k.
  struct Inputs {
    const SwarmView& swarm;
    const OverheadFrame& overhead;
    /// Ghosts from every other region for this one; empty without division into regions.
    std::span<const RadioGhosts* const> ghosts = {};
  };

  /// Messages of robots since the start. attempted = sent + aborted + packets on the air. Every packet sent counts once per
  /// robot that could receive it: as received, collided or faded. Robots drop packets with a wrong CRC, which count as sent
  /// alone. Packets of the overhead controller do not count.
  struct Counters {
    std::uint64_t attempted = 0;  ///< start pulses
    std::uint64_t sent = 0;       ///< whole packets
    std::uint64_t received = 0;
    std::uint64_t collided = 0;  ///< receptions lost to an overlapping signal
    std::uint64_t aborted = 0;   ///< given up in the leading octet
    std::uint64_t faded = 0;     ///< receptions lost by radio.loss
  };

  /// `firmware`: the plan's firmware robots at tick 0; required if the plan has any. `region`: this engine owns the robots in
  /// it. Frames and counts cover own robots only, so the sums over all regions equal those of a single engine. A
  /// divided channel supports no firmware robots, save() or load().
  explicit RadioEngine(const RunPlan&, std::unique_ptr<FirmwareRobots> firmware = nullptr, Region region = {});
  RadioEngine(const RadioEngine&) = delete;
  RadioEngine& operator=(const RadioEngine&) = delete;

  /// Advances from tick `from`, which must be the current one, to `from` + 1.
  void step(Tick from, const Inputs&);
  /// The frame of the current tick for one host.
  void emit(HostId, RadioFrame&) const;
  /// State of this engine at the current tick that the engine of another region needs.
  void emit_ghosts(const Region& to, RadioGhosts&) const;
  /// Distance from a region within which other regions' robots can affect it, mm.
  [[nodiscard]] double ghost_margin_mm() const;
  [[nodiscard]] std::uint64_t hash_part() const;
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Per robot.
  [[nodiscard]] const std::vector<RadioCount>& radio_counts() const { return radio_counts_; }
  /// Sorted by receiver, then sender; receiver == sender: its own successes. Empty unless recording.messages is set.
  [[nodiscard]] std::vector<PairCount> pair_counts() const { return pairs_.all(); }

  /// From now on messages sent, or received, are logged for the recording.
  void log_messages(bool sent, bool received) { logs_sent_ = sent, logs_received_ = received; }
  /// Those of the last step, in the order in which the engine came to know of them.
  [[nodiscard]] const std::vector<MessageEvent>& logged_messages() const { return logged_; }
  /// Null where there are no firmware robots.
  [[nodiscard]] const FirmwareRobots* firmware() const { return firmware_robots_.get(); }

  void save(proto::RadioState&) const;
  /// Restores the state saved at `tick`. Throws RunError if it does not fit the plan.
  void load(Tick tick, std::span<const proto::RadioState* const> parts);

 private:
  // Bits of a robot's state.
  static constexpr std::uint8_t kRunning = 1;    ///< its life cycle is RUNNING
  static constexpr std::uint8_t kReceptive = 2;  ///< it can receive
  static constexpr std::uint8_t kHolding = 4;    ///< its slot holds a message
  static constexpr std::uint8_t kSending = 8;    ///< it is sending
  static constexpr std::uint8_t kFirmware = 16;  ///< it runs firmware, which is listening

  struct Attempt {
    Cycles time;
    std::uint32_t robot;
  };
  static bool later(const Attempt& a, const Attempt& b);
  struct Arrival {
    Cycles end;
    std::uint32_t sender;  ///< kOverhead: the overhead controller
    std::uint32_t index;   ///< of the transmission, or of the overhead packet
  };
  static constexpr std::uint32_t kOverhead = 0xffffffffu;

  [[nodiscard]] bool is(std::uint32_t robot, std::uint8_t bits) const { return (state_[robot] & bits) == bits; }
  [[nodiscard]] Cycles begin_of(Tick tick) const { return tick.count() * cycles_per_tick_; }

  [[nodiscard]] bool owns(std::uint32_t robot) const { return !divided_ || owned_[robot] != 0; }

  void take_ghosts(std::span<const RadioGhosts* const>);
  void update_ownership();
  void read_poses(const SwarmView&);
  void read_life_cycles(const SwarmView&);
  void take_offers(const SwarmView&);
  void drop_message(std::uint32_t robot);
  void forget(Cycles begin);

  void contend(Tick now, const SwarmView&);
  void contend_until(Cycles end, Tick now);
  [[nodiscard]] Cycles next_exchange(Cycles end) const;
  void run_firmware(Cycles from, Cycles until, Tick now);
  void abort_interrupted(std::uint32_t robot, Cycles t, Tick now);
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
  void receive_in_range(const Transmission&, bool jammed, Tick now);
  void receive_by_strength(const Transmission&, bool jammed, Tick now);
  template <class Readings>
  void receive(const Transmission&, std::uint32_t receiver, bool is_lost, Tick now, Readings readings);
  void log_sent(std::uint32_t sender, Cycles time) {
    if (logs_sent_) logged_.push_back({time, sender, sender, 0});
  }
  void log_received(std::uint32_t receiver, std::uint32_t sender, Cycles time) {
    if (logs_received_) logged_.push_back({time, sender, receiver, 0});
  }
  void measure_logged(const SwarmView&);
  [[nodiscard]] bool fades(std::uint32_t receiver, Tick now, std::uint32_t draw) const;

  const Region region_;
  const bool divided_;               ///< several regions share the channel
  const std::vector<Share> shares_;  ///< per host
  const Cycles cycles_per_tick_;
  const double loss_;
  const bool counts_pairs_;
  const Random random_;
  const bool simple_;  ///< model SIMPLE: exchange_simply()
  const SimpleRadioSettings simple_model_;
  const Ranging ranging_;
  const Gains overhead_gains_;

  Tick tick_;
  TickTimers timers_;
  /// Per robot; external: it runs firmware, or it is real and says nothing here.
  std::vector<std::uint8_t> state_, is_external_;
  std::vector<std::uint8_t> deaf_;  ///< per robot: it is real, and no shadow of it runs here
  std::vector<std::uint8_t> owned_,
      known_;                             ///< per robot of a divided channel; known: owned, or a ghost
  std::vector<std::uint16_t> tx_period_;  ///< per robot
  std::vector<IrMessage> message_;        ///< per robot: content of its slot
  std::vector<std::uint16_t> crc_error_;  ///< per robot: of the message, as Transmission::crc_error
  std::vector<Cycles> next_send_;         ///< per robot, model SIMPLE: earliest time of its next message
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
  std::optional<FirmwareAir> firmware_;  ///< if the plan has firmware robots

  // For the recording alone.
  bool logs_sent_ = false, logs_received_ = false;
  std::vector<MessageEvent> logged_;

  // Within a step.
  std::size_t next_copy_ = 0;      ///< index of the overhead packet whose start pulse is next
  Cycles simulated_ = 0;           ///< time that firmware robots have reached
  std::vector<Attempt> attempts_;  ///< a heap, earliest first
  std::vector<Arrival> arrivals_;
  std::vector<std::uint32_t> rivals_;
  /// Per robot, for the current packet: the strongest other signal that it senses, dB.
  struct Rival {
    std::uint32_t packet = 0;  ///< value of packets_ for which margin_db holds
    float margin_db = 0;
  };
  std::vector<Rival> strongest_rival_;
  std::uint32_t packets_ = 0;  ///< number of packets processed
  std::vector<std::uint8_t> jammed_;
};

}  // namespace kilotwin::comm

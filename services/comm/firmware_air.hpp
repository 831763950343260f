/// The channel between firmware robots and all others, pulse by pulse.
///
/// Time advances in short spans. Within a span every robot first runs on its own. The engine then compares the light that
/// each robot was given with the light that the others produced. Robots with different light run the span again, until
/// nothing changes. The iteration ends because a pulse affects later pulses only. Its result does not depend on the order:
/// it is that of robots that run together, cycle by cycle. Spans without transmissions need no repetition.
///
/// Other robots see a firmware robot's packet as a Transmission: its start, its abort, or its end with the message.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"
#include "core/random/random.hpp"
#include "services/comm/channel.hpp"
#include "services/comm/firmware_robots.hpp"
#include "services/comm/link_budget.hpp"
#include "services/comm/neighbourhood.hpp"
#include "services/comm/overhead_controller.hpp"
#include "services/comm/packet_bits.hpp"
#include "services/comm/tick_timers.hpp"

namespace kilotwin::proto {
class RadioState;
}

namespace kilotwin::comm {

class FirmwareAir {
 public:
  /// Length of a span, 0.26 ms. A native robot's carrier sense detects firmware robots' packets of earlier spans only. If both
  /// start in the same span, the native start pulse makes the firmware robot give up.
  static constexpr Cycles kSpan = FirmwareRobots::kSpan;
  /// Up to this number of spans may run as one, with the same result, if only firmware robots send or are about to send.
  /// Threads then synchronise less often.
  static constexpr int kMostSpans = 4;

  /// An event of a firmware robot's transmission.
  struct Event {
    PulseDecoder::Event kind;
    std::uint32_t robot;  ///< id
    Cycles time;
    Cycles end;     ///< end of the transmission; kStarted: an upper bound of it
    Packet packet;  ///< kReceived
  };

  FirmwareAir(const RunPlan&, FirmwareRobots&, const TickTimers&, const Neighbourhood&, LinkBudget&, const Ranging&,
              Gains overhead_gains);

  [[nodiscard]] bool has(std::uint32_t robot) const { return index_[robot] != kNobody; }
  [[nodiscard]] bool listening(std::uint32_t robot) const { return outputs_[index_[robot]].listening; }
  [[nodiscard]] std::span<const std::uint32_t> ids() const { return robots_.ids(); }
  [[nodiscard]] const FirmwareRobots::Outputs& outputs(std::uint32_t i) const { return outputs_[i]; }
  /// Life cycle that the robot should have after the overhead messages that it received.
  [[nodiscard]] LifeCycle life_cycle(std::uint32_t i) const { return life_cycle_[i]; }

  /// Takes the poses of the tick that begins.
  void begin_tick(const SwarmView&);
  /// Simulates [from, until): one span or several. Returns the events in order of time, valid until the next call.
  const std::vector<Event>& advance(Cycles from, Cycles until, const Channel&, const OverheadController&);
  /// Reads the robots' outputs.
  void end_tick();
  /// A robot has received a message.
  void note_reception(std::uint32_t robot, const IrMessage&);
  /// Whether a packet that starts at `start` is lost at a firmware robot by radio.loss; `sender`: an id, or kOverhead.
  [[nodiscard]] bool fades(std::uint32_t receiver, std::uint32_t sender, Cycles start) const;

  [[nodiscard]] std::uint64_t hash() const;
  void save(proto::RadioState&) const;
  /// Throws RunError if the part does not fit.
  void load(const proto::RadioState&);

  static constexpr std::uint32_t kOverhead = 0xffffffffu;

 private:
  static constexpr std::uint32_t kNobody = 0xffffffffu;
  struct Neighbour {
    std::uint32_t index;  ///< of a firmware robot within range
    Gains gains;
  };
  struct Start {
    Cycles time;
    std::uint32_t robot;  ///< id
  };

  [[nodiscard]] Gains gains(std::uint32_t sender, std::uint32_t receiver);
  void collect_packets(Cycles from, Cycles until, const Channel&, const OverheadController&);
  void find_starts();
  void collect_light(Cycles from, Cycles until, std::vector<std::vector<Pulse>>& light);
  void decode_flashes(Cycles from, Cycles until);
  void read_outputs();

  FirmwareRobots& robots_;
  const Neighbourhood& neighbourhood_;
  LinkBudget& links_;
  const Ranging& ranging_;
  const Gains overhead_gains_;
  const Cycles cycles_per_tick_;
  const double loss_;
  const Random random_;
  std::vector<std::uint32_t> index_;  ///< per robot of the run: its index among the firmware robots, or kNobody

  // Per firmware robot.
  std::vector<PulseDecoder> decoders_;
  std::vector<FirmwareRobots::Outputs> outputs_;
  std::vector<LifeCycle> life_cycle_;
  std::vector<std::vector<Neighbour>> neighbours_;  ///< firmware robots within range, ascending
  std::vector<std::vector<Pulse>> light_, next_light_;
  std::vector<std::vector<Cycles>> flashes_;
  std::vector<std::vector<Cycles>> flash_starts_;  ///< per flash: start of its packet

  // Of the current span.
  struct Packet {
    Cycles start;
    std::uint32_t sender;  ///< id, or kOverhead
    bool fragile;          ///< a start pulse in its leading octet aborts it
    PacketBits bits;
  };
  std::vector<Packet> packets_;  ///< of native robots and of the overhead controller
  std::vector<Start> starts_;
  std::vector<std::uint32_t> all_, again_;
  std::vector<std::size_t> decoded_;  ///< per robot: number of flashes that are decoded
  std::vector<Event> events_;
};

}  // namespace kilotwin::comm

/// The air between firmware robots and all others, pulse by pulse.
///
/// Time goes on in short spans. Within one, every robot runs on its own; then the light that each was given is compared with
/// what the others have made of the span, and whoever was given too little or too much runs again, until nothing changes. A
/// pulse acts on later ones only, so that this ends, and with one result whatever the order: that of robots which run
/// together, cycle by cycle. It is repeated where somebody transmits and nowhere else.
///
/// Others hear of a firmware robot as of a transmission: when one starts, is given up, or ends with its message.
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
  /// Length of a span, 0.26 ms. A native robot that wants to send hears firmware robots' packets that started in earlier
  /// spans only; the start pulse of one of the same span makes the firmware robot give up.
  static constexpr Cycles kSpan = FirmwareRobots::kSpan;
  /// So many spans may go together, with the same result, where only firmware robots send or are about to: threads meet less
  /// often.
  static constexpr int kMostSpans = 4;

  /// Of a firmware robot's transmissions.
  struct Event {
    PulseDecoder::Event kind;
    std::uint32_t robot;  ///< id
    Cycles time;
    Cycles end;         ///< of what it has on the air; kStarted: when it has certainly ended
    IrMessage message;  ///< kReceived
  };

  FirmwareAir(const RunPlan&, FirmwareRobots&, const TickTimers&, const Neighbourhood&, LinkBudget&, const Ranging&,
              Gains overhead_gains);

  [[nodiscard]] bool has(std::uint32_t robot) const { return index_[robot] != kNobody; }
  [[nodiscard]] bool listening(std::uint32_t robot) const { return outputs_[index_[robot]].listening; }
  [[nodiscard]] std::span<const std::uint32_t> ids() const { return robots_.ids(); }
  [[nodiscard]] const FirmwareRobots::Outputs& outputs(std::uint32_t i) const { return outputs_[i]; }
  /// As the overhead messages that a robot has heard should have it.
  [[nodiscard]] LifeCycle life_cycle(std::uint32_t i) const { return life_cycle_[i]; }

  /// Poses are those of the tick that begins.
  void begin_tick(const SwarmView&);
  /// From `from` to `until`, one span or several. Returns what happened, in the order of time, valid until the next call.
  const std::vector<Event>& advance(Cycles from, Cycles until, const Channel&, const OverheadController&);
  /// Reads what the robots show.
  void end_tick();
  /// A robot has received a message.
  void note_reception(std::uint32_t robot, const IrMessage&);
  /// Whether what starts at `start` fades at a firmware robot; `sender`: an id, or kOverhead.
  [[nodiscard]] bool fades(std::uint32_t receiver, std::uint32_t sender, Cycles start) const;

  [[nodiscard]] std::uint64_t hash() const;
  void save(proto::RadioState&) const;
  /// Throws RunError where the part does not fit.
  void load(const proto::RadioState&);

  static constexpr std::uint32_t kOverhead = 0xffffffffu;

 private:
  static constexpr std::uint32_t kNobody = 0xffffffffu;
  struct Neighbour {
    std::uint32_t index;  ///< of one that is heard
    Gains gains;
  };
  struct Start {
    Cycles time;
    std::uint32_t robot;  ///< id
  };

  [[nodiscard]] Gains gains(std::uint32_t sender, std::uint32_t receiver);
  void collect_packets(Cycles from, Cycles until, const Channel&, const OverheadController&);
  void find_starts();
  void shine(Cycles from, Cycles until, std::vector<std::vector<Pulse>>& light);
  void settle(Cycles from, Cycles until);
  void show();

  FirmwareRobots& robots_;
  const Neighbourhood& neighbourhood_;
  LinkBudget& links_;
  const Ranging& ranging_;
  const Gains overhead_gains_;
  const Cycles cycles_per_tick_;
  const double loss_;
  const Random random_;
  std::vector<std::uint32_t> index_;  ///< per robot of the run: its index here, or kNobody

  // Per firmware robot.
  std::vector<PulseDecoder> decoders_;
  std::vector<FirmwareRobots::Outputs> outputs_;
  std::vector<LifeCycle> life_cycle_;
  std::vector<std::vector<Neighbour>> neighbours_;  ///< firmware robots that it hears, ascending
  std::vector<std::vector<Pulse>> light_, next_light_;
  std::vector<std::vector<Cycles>> flashes_;
  std::vector<std::vector<Cycles>> flash_starts_;  ///< of each flash: when its packet started

  // Of the span at hand.
  struct Packet {
    Cycles start;
    std::uint32_t sender;  ///< id, or kOverhead
    bool fragile;          ///< a start pulse in its leading byte ends it
    PacketBits bits;
  };
  std::vector<Packet> packets_;  ///< of robots with native programs, and copies of the overhead controller
  std::vector<Start> starts_;
  std::vector<std::uint32_t> all_, again_;
  std::vector<std::size_t> settled_;  ///< per robot: flashes that are done with
  std::vector<Event> events_;
};

}  // namespace kilotwin::comm

/// The overhead controller: turns the station's packets into copies on the air, which every robot hears. It never listens.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frames/frames.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::proto {
class OverheadControllerState;
}

namespace kilotwin::comm {

class OverheadController {
 public:
  struct Copy {
    Cycles start;
    IrMessage message;
    [[nodiscard]] Cycles end() const { return start + kPacket; }
    [[nodiscard]] bool overlaps(Cycles from, Cycles until) const { return start < until && from < end(); }
    [[nodiscard]] bool sensed_at(Cycles t) const { return t - start >= kNoticed && t < end(); }
  };

  /// Takes the packets of a tick, by ascending offset, and starts all copies that are due before `end`, where the tick
  /// that begins at `begin` ends. A packet ends what earlier offsets have left. Of the packets with one offset, each
  /// message goes out at least once, in order. A copy on the air, and the pause after it, are brought to their end.
  void advance(std::span<const OverheadPacket> packets, Cycles begin, Cycles end);
  /// Copies in the order of their start.
  [[nodiscard]] const std::vector<Copy>& copies() const { return copies_; }
  /// Forgets copies that are over at `t`.
  void forget(Cycles t);

  [[nodiscard]] std::uint64_t hash() const;
  void save(proto::OverheadControllerState&) const;
  void load(const proto::OverheadControllerState&);

 private:
  void command(std::span<const OverheadPacket> packets, Cycles now);
  void start_copies(Cycles end);

  Cycles next_ = 0;  ///< when a copy can start
  bool repeating_ = false;
  IrMessage message_{};             ///< what is repeated
  std::vector<IrMessage> waiting_;  ///< goes first, once each
  std::vector<Copy> copies_;
};

}  // namespace kilotwin::comm

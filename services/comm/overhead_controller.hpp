/// The overhead controller: turns the station's packets into messages on the air, which every robot hears. It never listens.
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
  /// A message on the air.
  struct Copy {
    Cycles start;
    IrMessage message;
    std::uint16_t crc;  ///< as sent
    [[nodiscard]] Cycles end() const { return start + kPacket; }
    [[nodiscard]] bool overlaps(Cycles from, Cycles until) const { return start < until && from < end(); }
    [[nodiscard]] bool sensed_at(Cycles t) const { return t - start >= kNoticed && t < end(); }
    /// A robot takes it: its CRC is right.
    [[nodiscard]] bool is_sound() const;
  };

  /// Takes the packets of a tick, by ascending offset, and starts all copies that are due before `end`, where the tick
  /// that begins at `begin` ends. A packet ends what earlier offsets have left, but for pages and GPS frames that wait. Of
  /// the packets with one offset, each message goes out at least once, in order. A page or a GPS frame goes on to its end.
  /// A copy on the air, and the pause after it, are brought to their end.
  void advance(std::span<const OverheadPacket> packets, Cycles begin, Cycles end);
  /// Copies in the order of their start.
  [[nodiscard]] const std::vector<Copy>& copies() const { return copies_; }
  /// Forgets copies that are over at `t`.
  void forget(Cycles t);

  [[nodiscard]] std::uint64_t hash() const;
  void save(proto::OverheadControllerState&) const;
  /// Throws RunError where the state is damaged.
  void load(const proto::OverheadControllerState&);

 private:
  /// A message that goes out once.
  struct Item {
    IrMessage message;
    std::uint16_t crc;
    Cycles
        pace;  ///< from its start to the earliest start of what follows; kOverheadPeriod unless of a page or GPS frame
  };

  void command(std::span<const OverheadPacket> packets, Cycles now);
  void enqueue(const OverheadPacket& packet);
  void add_page(const OverheadPacket& packet);
  void add_gps_frame(const OverheadPacket& packet);
  void start_copies(Cycles end);

  Cycles next_ = 0;  ///< when a copy can start
  bool repeating_ = false;
  IrMessage message_{};  ///< what is repeated
  std::uint16_t crc_ = 0;
  std::vector<Item> waiting_;  ///< goes first, once each
  std::vector<Copy> copies_;
};

}  // namespace kilotwin::comm

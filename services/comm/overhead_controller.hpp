/// The overhead controller: sends the station's packets as infrared messages, which every robot can hear. It does not receive.
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
    std::uint16_t crc;  ///< the checksum that it carries, right or wrong
    [[nodiscard]] Cycles end() const { return start + kPacket; }
    [[nodiscard]] bool overlaps(Cycles from, Cycles until) const { return start < until && from < end(); }
    [[nodiscard]] bool sensed_at(Cycles t) const { return t - start >= kNoticed && t < end(); }
    /// Whether its checksum is right. Robots drop messages with a wrong one.
    [[nodiscard]] bool is_sound() const;
  };

  /// Takes the packets of the tick from `begin` to `end`, in ascending order of their offsets, and starts all copies that are
  /// due before `end`. A packet replaces all messages of earlier offsets, except waiting pages and GPS frames. Messages of
  /// packets with the same offset are each sent at least once, in order. A page or a GPS frame is always sent to its end, and
  /// so are a copy on the air and the pause after it.
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
    /// From its start to the earliest start of the next message. kOverheadPeriod, except within a page or a GPS frame.
    Cycles pace;
  };

  void command(std::span<const OverheadPacket> packets, Cycles now);
  void enqueue(const OverheadPacket& packet);
  void add_page(const OverheadPacket& packet);
  void add_gps_frame(const OverheadPacket& packet);
  void start_copies(Cycles end);

  Cycles next_ = 0;  ///< the earliest start of the next copy
  bool repeating_ = false;
  IrMessage message_{};  ///< the message that is repeated
  std::uint16_t crc_ = 0;
  std::vector<Item> waiting_;  ///< sent before any repetition, once each
  std::vector<Copy> copies_;
};

}  // namespace kilotwin::comm

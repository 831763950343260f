/// Packets of the station that wait for the serial line, in the order in which they are due.
///
/// The line is slower than the station may be. Of packets that wait longer than kLongestWait, those are dropped that a later
/// one is due to follow: the controller would repeat them no longer. Packets that act by themselves (pages, GPS frames, the
/// LED) are kept. So a STOP that follows any number of messages waits kLongestWait and two packets of the line at most.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

#include "core/frames/overhead_packet.hpp"

namespace kilotwin::ohc {

class PacketQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kLongestWait{100};
  /// More than the 220 pages of the longest program.
  static constexpr std::size_t kMost = 256;

  /// A packet is never due before those that came earlier. Beyond kMost the oldest packet is dropped.
  void put(const OverheadPacket& packet, Time due);
  /// The next packet that is due at `now`.
  [[nodiscard]] std::optional<OverheadPacket> take(Time now);
  /// When the next packet is due; nothing where none waits.
  [[nodiscard]] std::optional<Time> next_due() const;
  /// Drops all that waits.
  void clear();
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  struct Entry {
    OverheadPacket packet;
    Time due;
  };
  [[nodiscard]] bool is_outdated(Time now) const;
  void drop_first();

  std::deque<Entry> queue_;
  std::uint64_t dropped_ = 0;
};

}  // namespace kilotwin::ohc

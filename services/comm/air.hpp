/// Timing of the infrared channel: the length of a packet, and when a robot senses it. All times are in cycles of the nominal
/// 8 MHz clock. Source of the numbers: kilolib's transmitter and receiver.
#pragma once

#include <cstdint>

#include "core/frames/frames.hpp"

namespace kilotwin::comm {

/// A point in time or a duration, nominal cycles; tick k begins at k times the tick's length.
using Cycles = std::int64_t;

/// One bit: a light pulse for 1, no light for 0. 33.625 us.
inline constexpr Cycles kBit = 269;
/// A packet: a leading octet of zeros and 12 octets, each with a start and a stop bit. 4.371 ms.
inline constexpr Cycles kPacket = 13 * 10 * kBit;
/// Delay from a start pulse to carrier sense at its receivers: the interrupt of their comparator.
inline constexpr Cycles kNoticed = 16;
/// A sender is deaf for two bits from its start. It then polls its receiver 235 times, every 8 cycles, until the leading
/// octet ends.
inline constexpr Cycles kDeaf = 2 * kBit;
inline constexpr Cycles kListening = kDeaf + 235 * 8;
/// Time for which an aborted packet occupies the channel: its start pulse.
inline constexpr Cycles kStartPulse = kBit;

/// Timer 0 of a robot, which drives its kilo_ticks: 256 counts of 1024 cycles of the robot's own clock.
inline constexpr Cycles kTimerCount = 1024;
inline constexpr Cycles kTimerCounts = 256;

/// Period of the overhead controller's packets: a packet, then 6 ms of LED. 10.409 ms.
inline constexpr Cycles kOverheadPeriod = 83272;
/// From one message of a page of flash to the next: a packet, and the controller's loop between two of them as in
/// kOverheadPeriod. A GPS frame waits 50 us more. After either the controller's LED is on for 10 ms and off for 10 ms.
inline constexpr Cycles kBurstPeriod = kPacket + 302, kGpsPause = 400, kBurstPause = 160'000;

/// A robot's packet on the air, in [start, end).
struct Transmission {
  Cycles start = 0, end = 0;
  std::uint32_t sender = 0;
  bool aborted = false;   ///< given up in its leading octet
  bool orphaned = false;  ///< its sender has left RUNNING; its end is not reported to the host
  IrMessage message{};
  bool over = false;            ///< sent by a firmware robot, and ended; `aborted` and `message` are final
  std::uint16_t crc_error = 0;  ///< its CRC XOR the right one; receivers drop it unless 0

  [[nodiscard]] bool overlaps(Cycles from, Cycles until) const { return start < until && from < end; }
  /// Whether carrier sense of other robots detects it at time t.
  [[nodiscard]] bool sensed_at(Cycles t) const { return t - start >= kNoticed && t < end; }
  /// Whether its sender detects another start pulse at time t.
  [[nodiscard]] bool notices(Cycles t) const { return t - start >= kDeaf && t - start < kListening && t < end; }
};

}  // namespace kilotwin::comm

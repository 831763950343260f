/// The infrared channel in time: what a packet is made of and what a robot notices of it. All times in cycles of the
/// nominal 8 MHz. Source of the numbers: kilolib's transmitter and receiver.
#pragma once

#include <cstdint>

#include "core/frames/frames.hpp"

namespace kilotwin::comm {

/// An instant or a length on the timeline of nominal cycles; tick k begins at k times the tick's length.
using Cycles = std::int64_t;

/// One bit: a pulse of light for 1, darkness for 0. 33.625 us.
inline constexpr Cycles kBit = 269;
/// A packet: a leading byte of zeros and 12 bytes, each with a start and a stop bit. 4.371 ms.
inline constexpr Cycles kPacket = 13 * 10 * kBit;
/// From a start pulse to where the receivers that hear it know that the air is taken: their comparator's interrupt.
inline constexpr Cycles kNoticed = 16;
/// A sender hears nothing for two bits from its start on, then it polls its receiver 235 times, every 8 cycles, until the
/// leading byte is over.
inline constexpr Cycles kDeaf = 2 * kBit;
inline constexpr Cycles kListening = kDeaf + 235 * 8;
/// What is on the air of a packet that is given up: its start pulse.
inline constexpr Cycles kStartPulse = kBit;

/// Timer 0 of a robot, which makes its kilo_ticks: 256 counts of 1024 cycles of its own clock.
inline constexpr Cycles kTimerCount = 1024;
inline constexpr Cycles kTimerCounts = 256;

/// Period of the overhead controller's copies: a packet, then 6 ms of LED. 10.409 ms.
inline constexpr Cycles kOverheadPeriod = 83272;

/// A robot's packet on the air, from `start` to before `end`.
struct Transmission {
  Cycles start = 0, end = 0;
  std::uint32_t sender = 0;
  bool aborted = false;   ///< given up in its leading byte
  bool orphaned = false;  ///< its sender has left RUNNING; its end is not reported to the host
  IrMessage message{};
  bool over = false;  ///< of a firmware robot, which has ended it: how is known

  [[nodiscard]] bool overlaps(Cycles from, Cycles until) const { return start < until && from < end; }
  /// Whether another robot's receiver is busy with it at an instant.
  [[nodiscard]] bool sensed_at(Cycles t) const { return t - start >= kNoticed && t < end; }
  /// Whether its sender notices a start pulse at an instant.
  [[nodiscard]] bool notices(Cycles t) const { return t - start >= kDeaf && t - start < kListening && t < end; }
};

}  // namespace kilotwin::comm

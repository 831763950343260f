/// A packet as pulses of light: 13 octets, the first one zero, the last two the CRC, each with a start and a stop bit; a
/// pulse is a 1.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>

#include "core/frames/frames.hpp"
#include "services/comm/air.hpp"

namespace kilotwin::comm {

inline constexpr std::size_t kBitsPerOctet = 10, kPacketBits = 13 * kBitsPerOctet;
using PacketBits = std::bitset<kPacketBits>;

/// CRC-16/MCRF4XX of data and type, as kilolib computes it.
[[nodiscard]] std::uint16_t message_crc(const IrMessage&);
[[nodiscard]] PacketBits packet_bits(const IrMessage&);
/// The message, unless a robot would drop the packet.
[[nodiscard]] std::optional<IrMessage> message_of(const PacketBits&);

/// Follows the pulses of one sender, as a receiver does: it counts bits anew from every octet's start bit.
class PulseDecoder {
 public:
  enum class Event : std::uint8_t {
    kNone,
    kStarted,   ///< with this pulse
    kAborted,   ///< the packet was given up in its leading octet
    kReceived,  ///< message() is whole
    kGarbled    ///< it was no packet
  };
  struct State {
    Cycles start = 0;         ///< of the packet
    Cycles octet_start = 0;   ///< of the octet at hand
    std::uint32_t octet = 0;  ///< 0..12
    bool busy = false;        ///< with a packet
    PacketBits bits;          ///< pulses so far
  };

  /// The sender's bits last kBit * period / 2^18 nominal cycles.
  explicit PulseDecoder(Cycles period) : period_(period) {}

  /// What is known at `now`, after all pulses before it; `flash`: a pulse begins there, which feed() is to take next.
  Event pass(Cycles now, bool flash);
  /// A pulse begins, after pass() of the same instant. kStarted, kReceived or kNone.
  Event feed(Cycles now);

  [[nodiscard]] const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }
  [[nodiscard]] const IrMessage& message() const { return message_; }
  /// So many bits of this sender, nominal cycles.
  [[nodiscard]] Cycles bits(Cycles count) const { return count * kBit * period_ / kRegularPeriod; }

 private:
  static constexpr Cycles kRegularPeriod = kTimerCounts * kTimerCount;
  /// Number of the octet's bit that is nearest to `now`.
  [[nodiscard]] Cycles nearest(Cycles now) const {
    const Cycles own = (now - state_.octet_start) * kRegularPeriod / period_;
    return (own + kBit / 2) / kBit;
  }
  /// Whether pulse `bit` of the octet at hand has come.
  [[nodiscard]] bool has(std::size_t bit) const { return state_.bits[state_.octet * kBitsPerOctet + bit]; }

  Cycles period_;
  State state_;
  IrMessage message_{};
};

}  // namespace kilotwin::comm

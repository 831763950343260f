/// A packet as light pulses: 13 octets, the first of zeros, the last two the CRC, each with a start and a stop bit. A pulse
/// is a 1.
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
/// With a CRC that may be wrong.
[[nodiscard]] PacketBits packet_bits(const IrMessage&, std::uint16_t crc);
/// A packet with all its start and stop bits and a leading octet of zeros.
struct Packet {
  IrMessage message{};
  std::uint16_t crc_error = 0;  ///< its CRC XOR the right one; a robot drops it unless 0
};
/// The packet of these bits; nullopt if they are none.
[[nodiscard]] std::optional<Packet> packet_of(const PacketBits&);

/// Decodes the pulses of one sender as a receiver does: it synchronises to the start bit of each octet.
class PulseDecoder {
 public:
  enum class Event : std::uint8_t {
    kNone,
    kStarted,   ///< this pulse starts a packet
    kAborted,   ///< the sender gave up in the leading octet
    kReceived,  ///< packet() is complete
    kGarbled    ///< the pulses are no valid packet
  };
  struct State {
    Cycles start = 0;         ///< of the packet
    Cycles octet_start = 0;   ///< of the current octet
    std::uint32_t octet = 0;  ///< 0..12
    bool busy = false;        ///< within a packet
    PacketBits bits;          ///< pulses up to the current time
  };

  /// `period`: the sender's timer period. Its bits last kBit * period / 2^18 nominal cycles.
  explicit PulseDecoder(Cycles period) : period_(period) {}

  /// Advances to `now`, after all earlier pulses. `flash`: a pulse begins at `now`; pass it to feed() next.
  Event pass(Cycles now, bool flash);
  /// Takes a pulse that begins at `now`, after pass() of the same time. Returns kStarted, kReceived or kNone.
  Event feed(Cycles now);

  [[nodiscard]] const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }
  [[nodiscard]] const Packet& packet() const { return packet_; }
  /// Duration of `count` bits of this sender, nominal cycles.
  [[nodiscard]] Cycles bits(Cycles count) const { return count * kBit * period_ / kRegularPeriod; }

 private:
  static constexpr Cycles kRegularPeriod = kTimerCounts * kTimerCount;
  /// Index of the octet's bit that is nearest to `now`.
  [[nodiscard]] Cycles nearest(Cycles now) const {
    const Cycles own = (now - state_.octet_start) * kRegularPeriod / period_;
    return (own + kBit / 2) / kBit;
  }
  /// Whether pulse `bit` of the current octet has arrived.
  [[nodiscard]] bool has(std::size_t bit) const { return state_.bits[state_.octet * kBitsPerOctet + bit]; }

  Cycles period_;
  State state_;
  Packet packet_;
};

}  // namespace kilotwin::comm

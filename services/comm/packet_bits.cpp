#include "services/comm/packet_bits.hpp"

#include <algorithm>
#include <array>

#include "core/base/message_crc.h"

namespace kilotwin::comm {
namespace {

constexpr std::size_t kStopBit = kBitsPerOctet - 1;

}  // namespace

std::uint16_t message_crc(const IrMessage& message) { return kilotwin_message_crc(message.data()); }

PacketBits packet_bits(const IrMessage& message) { return packet_bits(message, message_crc(message)); }

PacketBits packet_bits(const IrMessage& message, std::uint16_t crc) {
  std::array<std::uint8_t, 13> octets{};
  std::copy(message.begin(), message.end(), octets.begin() + 1);
  octets[11] = static_cast<std::uint8_t>(crc & 0xff);
  octets[12] = static_cast<std::uint8_t>(crc >> 8);
  PacketBits bits;
  for (std::size_t i = 0; i < octets.size(); ++i) {
    bits.set(i * kBitsPerOctet);
    for (std::size_t b = 0; b < 8; ++b) bits.set(i * kBitsPerOctet + 1 + b, (octets[i] >> b & 1) != 0);
    bits.set(i * kBitsPerOctet + kStopBit);
  }
  return bits;
}

std::optional<Packet> packet_of(const PacketBits& bits) {
  std::array<std::uint8_t, 13> octets{};
  for (std::size_t i = 0; i < octets.size(); ++i) {
    if (!bits[i * kBitsPerOctet] || !bits[i * kBitsPerOctet + kStopBit]) return std::nullopt;
    for (std::size_t b = 0; b < 8; ++b)
      octets[i] = static_cast<std::uint8_t>(octets[i] | int{bits[i * kBitsPerOctet + 1 + b]} << b);
  }
  if (octets[0] != 0) return std::nullopt;
  Packet packet;
  std::copy(octets.begin() + 1, octets.begin() + 11, packet.message.begin());
  packet.crc_error = static_cast<std::uint16_t>(message_crc(packet.message) ^ (octets[11] | octets[12] << 8));
  return packet;
}

PulseDecoder::Event PulseDecoder::pass(Cycles now, bool flash) {
  if (!state_.busy) return Event::kNone;
  const Cycles bit = nearest(now);
  constexpr Cycles kStop = kStopBit, kLatestStart = kBitsPerOctet + 1;
  const bool stopped = has(kStopBit);
  if (state_.octet == 0 && !stopped && (bit > kStop || (flash && bit > 0 && bit < kStop))) {
    state_.busy = false;
    return Event::kAborted;
  }
  if (bit <= (stopped ? kLatestStart : kStop)) return Event::kNone;
  state_.busy = false;
  return Event::kGarbled;
}

PulseDecoder::Event PulseDecoder::feed(Cycles now) {
  if (!state_.busy) {
    state_ = {now, now, 0, true, {}};
    state_.bits.set(0);
    return Event::kStarted;
  }
  if (has(kStopBit)) {
    if (nearest(now) < static_cast<Cycles>(kBitsPerOctet)) return Event::kNone;
    state_.octet_start = now;
    state_.bits.set(++state_.octet * kBitsPerOctet);
    return Event::kNone;
  }
  const auto bit = static_cast<std::size_t>(nearest(now));
  state_.bits.set(state_.octet * kBitsPerOctet + bit);
  if (bit != kStopBit || (state_.octet + 1) * kBitsPerOctet < kPacketBits) return Event::kNone;
  state_.busy = false;
  const std::optional<Packet> packet = packet_of(state_.bits);
  if (!packet) return Event::kGarbled;
  packet_ = *packet;
  return Event::kReceived;
}

}  // namespace kilotwin::comm

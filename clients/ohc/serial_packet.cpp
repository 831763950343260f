#include "clients/ohc/serial_packet.hpp"

namespace kilotwin::ohc {

SerialPacket encode(const OverheadPacket& packet) {
  SerialPacket octets{};
  octets[0] = kHeader;
  octets[1] = static_cast<std::uint8_t>(packet.command);
  const auto payload = packet.payload();
  std::copy(payload.begin(), payload.end(), octets.begin() + 2);
  std::uint8_t sum = 0;
  for (const std::uint8_t octet : octets) sum ^= octet;
  octets.back() = sum;
  return octets;
}

std::optional<OverheadPacket> PacketDecoder::take(std::uint8_t octet) {
  ++counters_.octets;
  loose_ = std::min(loose_ + 1, kSerialPacket);
  sum_ = static_cast<std::uint8_t>(sum_ ^ window_[first_] ^ octet);
  window_[first_] = octet;
  first_ = (first_ + 1) % kSerialPacket;
  if (at(0) != kHeader) return std::nullopt;
  if (sum_ != 0) {
    if (loose_ == kSerialPacket) {
      ++counters_.bad_checksums;
      loose_ = 0;
    }
    return std::nullopt;
  }
  OverheadPacket packet;
  packet.command = static_cast<OverheadCommand>(at(1));
  if (!is_known(packet.command)) {
    // Where a checksum is 0x55 and the packet after it begins, the window one octet before its end passes as well: its type
    // is the header.
    if (at(1) != kHeader) ++counters_.unknown_types;
    return std::nullopt;
  }
  ++counters_.packets;
  loose_ = 0;
  std::array<std::uint8_t, OverheadPacket::kPayload> payload{};
  for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = at(2 + i);
  packet.set_payload(payload);
  return packet;
}

void PacketDecoder::forget() {
  window_.fill(0);
  sum_ = 0;
  loose_ = 0;
}

}  // namespace kilotwin::ohc

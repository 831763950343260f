/// Packets for the overhead controller, as a host sends them down its serial line: 132 octets, of which the header 0x55 and
/// the checksum are left out here. Source: the serial protocol of kilolib's controller.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace kilotwin {

/// An infrared message without its CRC: data[9], type.
using IrMessage = std::array<std::uint8_t, 10>;

/// The types of packets, numbered as on the serial line.
enum class OverheadCommand : std::uint8_t {
  kStop = 0,       ///< silence
  kLedToggle = 1,  ///< silence, and the controller's own LED goes on or off
  kRepeat = 2,     ///< a message, again and again until the next packet
  kRaw = 3,        ///< 12 octets, CRC included, whatever they are; again and again until the next packet
  kBootPage = 4,   ///< a page of flash as 22 messages of type 0x81: page number, 128 octets
  kGpsFrame = 5,   ///< messages of type 1: up to 16 records of 8 octets, up to the first of zeros only
  kOnce = 6        ///< a message, once
};
[[nodiscard]] constexpr bool is_known(OverheadCommand command) { return command <= OverheadCommand::kOnce; }

/// Octets 1 to 130 of a packet on the serial line, its type and its payload; and when it is over. Laid out as on the wire:
/// 134 octets without padding.
struct OverheadPacket {
  static constexpr std::size_t kPayload = 129, kRest = kPayload - std::tuple_size_v<IrMessage>;

  OverheadCommand command = OverheadCommand::kStop;
  IrMessage message{};                     ///< the payload's first ten octets; kRepeat and kOnce have no others
  std::array<std::uint8_t, kRest> rest{};  ///< the payload's other octets
  std::array<std::uint8_t, 4> offset{};    ///< offset_cycles(), least octet first

  /// When within its tick it reaches the overhead controller, cycles from the tick's start, below the tick's length.
  [[nodiscard]] constexpr std::uint32_t offset_cycles() const {
    return offset[0] | std::uint32_t{offset[1]} << 8 | std::uint32_t{offset[2]} << 16 |
           std::uint32_t{offset[3]} << 24;
  }
  /// The same packet at another offset.
  [[nodiscard]] constexpr OverheadPacket at(std::uint32_t offset_cycles) const {
    OverheadPacket packet = *this;
    for (std::uint8_t& octet : packet.offset) {
      octet = static_cast<std::uint8_t>(offset_cycles & 255);
      offset_cycles >>= 8;
    }
    return packet;
  }
  [[nodiscard]] std::array<std::uint8_t, kPayload> payload() const {
    std::array<std::uint8_t, kPayload> octets{};
    std::copy(rest.begin(), rest.end(), std::copy(message.begin(), message.end(), octets.begin()));
    return octets;
  }
  /// Takes up to kPayload octets; the others become 0.
  void set_payload(std::span<const std::uint8_t> octets) {
    std::array<std::uint8_t, kPayload> all{};
    std::copy_n(octets.begin(), std::min(octets.size(), kPayload), all.begin());
    std::copy_n(all.begin(), message.size(), message.begin());
    std::copy(all.begin() + message.size(), all.end(), rest.begin());
  }
  /// Whether the payload ends with the message.
  [[nodiscard]] bool is_short() const {
    return std::all_of(rest.begin(), rest.end(), [](std::uint8_t octet) { return octet == 0; });
  }
  bool operator==(const OverheadPacket&) const = default;
};

/// Type and payload for records, without the offset: 11 octets where the payload ends with the message, else 130.
[[nodiscard]] inline std::string octets_of(const OverheadPacket& packet) {
  std::string octets(1, static_cast<char>(packet.command));
  octets.append(packet.message.begin(), packet.message.end());
  if (!packet.is_short()) octets.append(packet.rest.begin(), packet.rest.end());
  return octets;
}

/// Inverse of octets_of(). Nothing if the octets are no packet.
[[nodiscard]] inline std::optional<OverheadPacket> packet_of(std::string_view octets) {
  constexpr std::size_t kShort = 1 + std::tuple_size_v<IrMessage>, kLong = 1 + OverheadPacket::kPayload;
  if (octets.size() != kShort && octets.size() != kLong) return std::nullopt;
  OverheadPacket packet;
  packet.command = static_cast<OverheadCommand>(octets[0]);
  std::copy_n(octets.begin() + 1, packet.message.size(), packet.message.begin());
  std::copy(octets.begin() + kShort, octets.end(), packet.rest.begin());
  return packet;
}

}  // namespace kilotwin

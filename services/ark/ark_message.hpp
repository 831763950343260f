/// ARK's messages: three of them, for three robots, packed in one infrared message of type 0.
///   slot i = 0..2:  data[3i] = id >> 2;  data[3i+1] = (id & 3) << 6 | type << 2 | payload >> 8;  data[3i+2] = payload & 255
/// Unused slots carry id 1023 (KilobotArena, kilobot_message).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/frames/frames.hpp"

namespace kilotwin::ark {

struct ArkMessage {
  std::uint16_t id = 0;       ///< robot, 0..1022
  std::uint8_t type = 0;      ///< 0..15
  std::uint16_t payload = 0;  ///< 0..1023
  bool operator==(const ArkMessage&) const = default;
};

inline constexpr std::size_t kArkSlots = 3;
/// Addresses nobody; robots' ids lie below.
inline constexpr std::uint16_t kArkNobody = 1023;

/// Packs up to three messages; the rest of the slots address nobody.
[[nodiscard]] constexpr IrMessage pack(std::span<const ArkMessage> messages) {
  IrMessage packed{};
  for (std::size_t i = 0; i < kArkSlots; ++i) {
    const ArkMessage message = i < messages.size() ? messages[i] : ArkMessage{kArkNobody, 0, 0};
    packed[3 * i] = static_cast<std::uint8_t>(message.id >> 2);
    packed[3 * i + 1] =
        static_cast<std::uint8_t>((message.id & 3) << 6 | (message.type & 15) << 2 | (message.payload >> 8 & 3));
    packed[3 * i + 2] = static_cast<std::uint8_t>(message.payload & 255);
  }
  return packed;
}

[[nodiscard]] constexpr std::array<ArkMessage, kArkSlots> unpack(const IrMessage& packed) {
  std::array<ArkMessage, kArkSlots> messages;
  for (std::size_t i = 0; i < kArkSlots; ++i) {
    const std::uint8_t high = packed[3 * i], middle = packed[3 * i + 1], low = packed[3 * i + 2];
    messages[i] = {static_cast<std::uint16_t>(high << 2 | middle >> 6), static_cast<std::uint8_t>(middle >> 2 & 15),
                   static_cast<std::uint16_t>((middle & 3) << 8 | low)};
  }
  return messages;
}

}  // namespace kilotwin::ark

/// Messages as strings of octets, ten octets each, and as 64-bit words.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "core/base/error.hpp"
#include "core/frames/frames.hpp"

namespace kilotwin::comm {

inline void append(std::string& octets, const IrMessage& message) { octets.append(message.begin(), message.end()); }

/// Message `i` of a string of messages. Throws RunError if the string is too short.
inline IrMessage message_at(const std::string& octets, std::size_t i) {
  IrMessage message;
  if (octets.size() < (i + 1) * message.size()) throw RunError("the radio's part of the checkpoint lacks messages");
  std::copy_n(octets.begin() + static_cast<std::ptrdiff_t>(i * message.size()), message.size(), message.begin());
  return message;
}

inline std::array<std::uint64_t, 2> words(const IrMessage& message) {
  std::array<std::uint64_t, 2> result{};
  for (std::size_t i = 0; i < message.size(); ++i) result[i / 8] |= std::uint64_t{message[i]} << 8 * (i % 8);
  return result;
}

}  // namespace kilotwin::comm

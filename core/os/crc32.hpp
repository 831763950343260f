/// CRC-32 (IEEE 802.3), by zlib.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

namespace kilotwin::os {

/// `before`: the CRC of the octets that precede these.
[[nodiscard]] inline std::uint32_t crc32(std::string_view octets, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const unsigned char*>(octets.data()), octets.size()));
}

}  // namespace kilotwin::os

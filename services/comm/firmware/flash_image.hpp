/// A program for the robot's ATmega328P as avr-gcc (.elf) or any other tool (.hex, Intel HEX) leaves it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace kilotwin::firmware {

/// Of an ATmega328P, octets.
inline constexpr std::uint32_t kFlashOctets = 32 * 1024, kEepromOctets = 1024, kPageOctets = 128;

struct FlashImage {
  std::array<std::uint8_t, kFlashOctets> flash;  ///< 0xff where the file has nothing
  std::uint32_t used_octets = 0;                 ///< up to the last octet that the file has
};

/// Whether a file's name says that it is firmware: .elf or .hex, in either case.
[[nodiscard]] bool is_firmware(const std::filesystem::path& file);

/// Reads either kind, told apart by the content. `name` is for messages. Throws UserError, with the line of a .hex file,
/// where it is neither, is damaged, is for another processor, or does not fit.
[[nodiscard]] FlashImage parse_firmware(std::string_view file, const std::string& name);

}  // namespace kilotwin::firmware

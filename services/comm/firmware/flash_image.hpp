/// A program for the robot's ATmega328P: an .elf file of avr-gcc, or an Intel HEX file of any tool.
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
  std::array<std::uint8_t, kFlashOctets> flash;  ///< 0xff at addresses that the file does not define
  std::uint32_t used_octets = 0;                 ///< length up to the last octet that the file defines
};

/// Whether a file's name says that it is firmware: .elf or .hex, in either case.
[[nodiscard]] bool is_firmware(const std::filesystem::path& file);

/// Reads either kind, and recognises it by its content. `name` is for messages. Throws UserError, with the line of a .hex file,
/// if the file is neither, is damaged, is for another processor, or does not fit.
[[nodiscard]] FlashImage parse_firmware(std::string_view file, const std::string& name);

}  // namespace kilotwin::firmware

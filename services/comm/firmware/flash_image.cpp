#include "services/comm/firmware/flash_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/base/error.hpp"

namespace kilotwin::firmware {
namespace {

using Octets = std::string_view;

// ELF, 32 bits, low octet first (System V ABI, chapter 4 and 5); machine number of the AVR.
constexpr std::uint32_t kElfHeader = 52, kProgramHeader = 32;
constexpr std::uint32_t kMachineAvr = 83, kLoad = 1;
/// From here on avr-gcc's linker places what is not flash: RAM, EEPROM, fuses.
constexpr std::uint32_t kBeyondFlash = 0x800000;

std::uint32_t word(Octets file, std::size_t at, std::size_t octets) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < octets; ++i) value |= std::uint32_t{static_cast<std::uint8_t>(file[at + i])} << 8 * i;
  return value;
}

/// Puts one octet into flash; false where there is none.
bool put(FlashImage& image, std::uint64_t address, std::uint8_t octet) {
  if (address >= kFlashOctets) return false;
  image.flash[address] = octet;
  image.used_octets = std::max(image.used_octets, static_cast<std::uint32_t>(address + 1));
  return true;
}

std::string too_large(std::uint64_t address) {
  return fmt::format("has code at {:#x}, and an ATmega328P has 32 KiB of flash", address);
}

void parse_elf(Octets file, const std::string& name, FlashImage& image) {
  const auto damaged = [&](const char* what) -> UserError {
    return UserError(name + ": " + what + "; build it again with avr-gcc -mmcu=atmega328p");
  };
  if (file.size() < kElfHeader) throw damaged("ends within its header");
  if (file[4] != 1 || file[5] != 1 || word(file, 18, 2) != kMachineAvr)
    throw damaged("is not for an AVR processor");
  const std::uint32_t table = word(file, 28, 4), size = word(file, 42, 2), count = word(file, 44, 2);
  if (size < kProgramHeader || table > file.size() || std::uint64_t{count} * size > file.size() - table)
    throw damaged("is damaged: its program headers lie outside of it");
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t at = table + std::size_t{i} * size;
    const std::uint32_t offset = word(file, at + 4, 4), address = word(file, at + 12, 4);
    const std::uint32_t octets = word(file, at + 16, 4);
    if (word(file, at, 4) != kLoad || octets == 0 || address >= kBeyondFlash) continue;
    if (offset > file.size() || octets > file.size() - offset)
      throw damaged("is damaged: a segment lies outside of it");
    for (std::uint32_t n = 0; n < octets; ++n) {
      if (!put(image, std::uint64_t{address} + n, static_cast<std::uint8_t>(file[offset + n])))
        throw damaged(too_large(std::uint64_t{address} + n).c_str());
    }
  }
}

/// The octets of one line of Intel HEX after its colon; empty where it holds anything but pairs of hexadecimal digits.
std::string octets_of(const std::string& line) {
  std::string octets;
  if (line.size() % 2 == 0) return {};
  for (std::size_t i = 1; i < line.size(); i += 2) {
    unsigned value = 0;
    for (const char c : {line[i], line[i + 1]}) {
      if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return {};
      value = value * 16 + static_cast<unsigned>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
    }
    octets.push_back(static_cast<char>(value));
  }
  return octets;
}

void parse_hex(Octets file, const std::string& name, FlashImage& image) {
  std::uint64_t base = 0;
  bool ended = false;
  int number = 0;
  const auto wrong = [&](const std::string& what) {
    return UserError(fmt::format("{}:{}:1: {}; each line is a record of Intel HEX, and the last one :00000001FF",
                                 name, number, what));
  };
  for (std::size_t at = 0; at < file.size() && !ended;) {
    ++number;
    std::string line;
    while (at < file.size() && file[at] != '\n') line.push_back(file[at++]);
    ++at;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty()) continue;
    const std::string octets = line[0] == ':' ? octets_of(line) : std::string{};
    const auto octet = [&](std::size_t i) { return static_cast<std::uint8_t>(octets[i]); };
    if (octets.size() < 5 || octets.size() != octet(0) + 5u) throw wrong("is no record");
    std::uint8_t sum = 0;
    for (std::size_t i = 0; i < octets.size(); ++i) sum = static_cast<std::uint8_t>(sum + octet(i));
    if (sum != 0) throw wrong("has a wrong checksum");
    const std::uint32_t address = std::uint32_t{octet(1)} << 8 | octet(2);
    const std::uint32_t high = octet(0) == 2 ? std::uint32_t{octet(4)} << 8 | octet(5) : 0;
    switch (octet(3)) {
      case 0:
        for (std::size_t n = 0; n < octet(0); ++n) {
          if (!put(image, base + address + n, octet(4 + n))) throw wrong(too_large(base + address + n));
        }
        break;
      case 1: ended = true; break;
      case 2: base = std::uint64_t{high} << 4; break;
      case 4: base = std::uint64_t{high} << 16; break;
      case 3:
      case 5: break;  // where to start: at 0, as the processor does
      default: throw wrong("is of an unknown kind");
    }
  }
  if (!ended) throw wrong("ends without an end record");
}

}  // namespace

bool is_firmware(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending == ".elf" || ending == ".hex";
}

FlashImage parse_firmware(Octets file, const std::string& name) {
  FlashImage image;
  image.flash.fill(0xff);
  if (file.starts_with("\x7f"
                       "ELF")) {
    parse_elf(file, name, image);
  } else if (!file.empty() && file[0] == ':') {
    parse_hex(file, name, image);
  } else {
    throw UserError(name +
                    ": is neither an ELF nor an Intel HEX file; give what avr-gcc or avr-objcopy -O ihex made");
  }
  if (image.used_octets == 0) throw UserError(name + ": holds no code; give a linked program, not an object file");
  return image;
}

}  // namespace kilotwin::firmware

// Firmware files: the resulting flash image, and errors in files.
#include "services/comm/firmware/flash_image.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.hpp"
#include "tests/services/comm/firmware/programs.hpp"

namespace kilotwin::firmware {
namespace {

const std::string kHex =
    ":020000040000FA\r\n"
    ":100000000C9434000C943E000C943E000C943E0082\r\n"
    ":03001000010203E7\n"
    ":00000001FF\n";

TEST(FlashImage, ContainsTheRecordsAndOtherwiseErasedFlash) {
  const FlashImage image = parse_firmware(kHex, "a.hex");
  EXPECT_EQ(image.flash[0], 0x0c);
  EXPECT_EQ(image.flash[1], 0x94);
  EXPECT_EQ(image.flash[0x12], 3);
  EXPECT_EQ(image.flash[0x13], 0xff);
  EXPECT_EQ(image.used_octets, 0x13u);
}

TEST(FlashImage, ElfAndHexGiveTheSameImage) {
  const FlashImage elf = firmware(whole_program("static void setup(void) {} static void loop(void) {}"));
  std::string hex;
  for (std::uint32_t at = 0; at < elf.used_octets; at += 16) {
    std::uint8_t sum = 0;
    char text[8];
    const auto put = [&](std::uint32_t octet) {
      std::snprintf(text, sizeof text, "%02x", octet & 0xff);
      hex += text;
      sum = static_cast<std::uint8_t>(sum + octet);
    };
    const std::uint32_t octets = std::min(16u, elf.used_octets - at);
    hex += ':';
    put(octets), put(at >> 8), put(at), put(0);
    for (std::uint32_t i = 0; i < octets; ++i) put(elf.flash[at + i]);
    put(0u - sum);
    hex += '\n';
  }
  const FlashImage image = parse_firmware(hex + ":00000001FF\n", "a.hex");
  EXPECT_EQ(image.flash, elf.flash);
  EXPECT_EQ(image.used_octets, elf.used_octets);
}

TEST(FlashImage, RefusesOtherFilesAndNamesTheLine) {
  const auto error = [](const std::string& text) -> std::string {
    try {
      static_cast<void>(parse_firmware(text, "a.hex"));
    } catch (const UserError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(error("").find("neither"), std::string::npos);
  EXPECT_NE(error("int main() {}").find("neither"), std::string::npos);
  EXPECT_NE(error(":0300100001020300\n").find("a.hex:1:1: has a wrong checksum"), std::string::npos);
  EXPECT_NE(error(":00000001FF\n").find("no code"), std::string::npos);
  EXPECT_NE(error(":03001000010203E7\n").find("without an end record"), std::string::npos);
  EXPECT_NE(error(":020000040001F9\n:03001000010203E7\n:00000001FF\n").find("a.hex:2:1: has code at 0x10010"),
            std::string::npos);
}

TEST(FlashImage, DamagedFilesAreRefusedOrLoaded) {
  const std::filesystem::path file =
      compiled(whole_program("static void setup(void) {} static void loop(void) {}"));
  const std::string elf = os::read_if_there(file).value();
  std::mt19937 random(1);
  int read = 0, refused = 0;
  for (int n = 0; n < 4000; ++n) {
    std::string damaged = n % 2 == 0 ? elf.substr(0, 4096) : kHex;
    if (n % 4 == 0) damaged = elf;
    for (int i = 0; i < 3; ++i)
      damaged[random() % std::min<std::size_t>(damaged.size(), 400)] = static_cast<char>(random());
    if (n % 3 == 0) damaged.resize(random() % damaged.size());
    try {
      static_cast<void>(parse_firmware(damaged, "a"));
      ++read;
    } catch (const UserError&) {
      ++refused;
    }
  }
  EXPECT_GT(read, 0);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace kilotwin::firmware

// The boot loader of this project in a simulated processor: a whole upload, and what it does when messages are lost.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "services/comm/firmware/eeprom.hpp"
#include "services/comm/firmware/mcu.hpp"
#include "services/comm/packet_bits.hpp"
#include "tests/services/comm/firmware/programs.hpp"

namespace kilotwin::firmware {
namespace {

constexpr OwnCycles kSecond = 8'000'000;
constexpr std::uint8_t kBoot = 0x80, kPagePart = 0x81, kSize = 0x82, kWakeup = 0x85, kRun = 0x88;
/// The boot section and what is before it.
constexpr std::uint32_t kSection = 0x7000;

FlashImage image_of(const std::string& source, bool boot_loader) {
  const std::filesystem::path file = compiled(source, boot_loader);
  return parse_firmware(os::read_if_there(file).value(), file.string());
}

const FlashImage& blank() {
  static const FlashImage image = image_of(
      whole_program("static void setup(void) { set_color(RGB(3, 0, 0)); } static void loop(void) {}"), true);
  return image;
}

/// A program of many pages, whose last ones matter.
const FlashImage& large() {
  static const FlashImage image = [] {
    std::string table;
    int sum = 0;
    for (int i = 0; i < 5000; ++i) {
      table += std::to_string(i * 37 % 251) + ",";
      sum += i * 37 % 251;
    }
    return image_of(
        "#include <avr/pgmspace.h>\n" +
            whole_program(
                "static const uint8_t table[] PROGMEM = {" + table +
                "};\nstatic void setup(void) { uint8_t sum = 0; for (uint16_t i = 0; i < sizeof table; ++i) "
                "sum += pgm_read_byte(table + i); set_color(sum == " +
                std::to_string(sum % 256) +
                " ? RGB(0, 3, 3) : RGB(3, 3, 3)); }\n"
                "static void loop(void) {}"),
        false);
  }();
  return image;
}

class Robot {
 public:
  explicit Robot(const FlashImage& image)
      : mcu(image, make_eeprom(5, Calibration{60, 61, 70, 71}, RangingTable{KILOTWIN_IR_HIGH, KILOTWIN_IR_LOW}),
            Random(1), 5) {
    mcu.run(kSecond / 10, {});
  }
  /// A message begins now; runs to `gap` cycles after its end.
  void hear(const IrMessage& message, OwnCycles gap = 48000) {
    const comm::PacketBits bits = comm::packet_bits(message);
    std::vector<Light> pulses;
    const OwnCycles start = mcu.now() + 20;
    for (std::size_t b = 0; b < bits.size(); ++b) {
      if (bits[b]) pulses.push_back({start + b * comm::kBit, 627, 464});
    }
    mcu.run(start + comm::kPacket + gap, pulses);
  }
  void hear(std::uint8_t type, std::uint8_t first = 0) {
    IrMessage message{};
    message[0] = first;
    message[9] = type;
    hear(message);
  }
  /// The 22 messages of a page, as the overhead controller sends them, then 20 ms; `lost` says which do not arrive.
  void hear_page(const FlashImage& image, std::uint8_t page, const std::function<bool()>& lost) {
    std::vector<Light> pulses;
    const double begin = static_cast<double>(mcu.now()) + 100;
    for (std::uint32_t at = 0; at < kPageOctets; at += 6) {
      IrMessage message{page, static_cast<std::uint8_t>(at / 2)};
      for (std::uint32_t n = 0; n < 6 && at + n < kPageOctets; ++n)
        message[2 + n] = image.flash[page * kPageOctets + at + n];
      message[9] = kPagePart;
      if (lost()) continue;
      const comm::PacketBits bits = comm::packet_bits(message);
      for (std::size_t b = 0; b < bits.size(); ++b) {
        const auto cycle =
            static_cast<double>(at / 6 * comm::kBurstPeriod + static_cast<comm::Cycles>(b) * comm::kBit);
        if (bits[b]) pulses.push_back({static_cast<OwnCycles>(begin + rate * cycle), 627, 464});
      }
    }
    mcu.run(mcu.now() + static_cast<OwnCycles>(rate * 22 * comm::kBurstPeriod + comm::kBurstPause), pulses);
  }
  /// Pages whose octets in flash are those of the image.
  [[nodiscard]] int pages_of(const FlashImage& image, int pages) const {
    int same = 0;
    for (int page = 0; page < pages; ++page) {
      const auto at = static_cast<std::ptrdiff_t>(page) * kPageOctets;
      same +=
          std::equal(image.flash.begin() + at, image.flash.begin() + at + kPageOctets, mcu.flash().begin() + at);
    }
    return same;
  }
  [[nodiscard]] bool in_boot_section() const { return mcu.program_counter() >= kSection; }

  Mcu mcu;
  double rate = 1;  ///< of its oscillator
};

int pages_of(const FlashImage& image) { return static_cast<int>(image.used_octets / kPageOctets) + 1; }
bool never() { return false; }

TEST(BootLoader, TakesAWholeProgramAndStartsIt) {
  const int pages = pages_of(large());
  ASSERT_GE(pages, 57);
  Robot robot(blank());
  robot.hear(kRun);
  EXPECT_EQ(robot.mcu.outputs().led, 3) << "the blank program runs";
  robot.hear(kBoot);
  EXPECT_TRUE(robot.in_boot_section());
  bool blue = false;
  for (int ms = 0; ms < 1100; ++ms) {
    robot.mcu.run(robot.mcu.now() + kSecond / 1000, {});
    blue = blue || robot.mcu.outputs().led == 0x30;
  }
  EXPECT_TRUE(blue) << "it waits with a blue flash";
  robot.hear(kSize, static_cast<std::uint8_t>(pages));
  for (int page = 0; page + 1 < pages; ++page) {
    robot.hear_page(large(), static_cast<std::uint8_t>(page), never);
    EXPECT_EQ(robot.mcu.outputs().led, 0x0c) << "green: page " << page << " is written";
    EXPECT_EQ(robot.pages_of(large(), page + 1), page + 1);
    EXPECT_TRUE(robot.in_boot_section());
  }
  robot.hear_page(large(), static_cast<std::uint8_t>(pages - 1), never);
  EXPECT_EQ(robot.pages_of(large(), pages), pages);
  EXPECT_FALSE(robot.in_boot_section());
  robot.hear(kRun);
  robot.mcu.run(robot.mcu.now() + kSecond / 10, {});
  EXPECT_EQ(robot.mcu.outputs().led, 0x3c) << "the other program runs";
  EXPECT_EQ(robot.mcu.halt(), Halt::kNone);
  robot.hear(kBoot);
  EXPECT_TRUE(robot.in_boot_section()) << "and can be replaced in turn";
}

/// Messages of a page follow each other with 571 cycles between their pulses, and clocks differ.
TEST(BootLoader, KeepsUpWithTheControllerAtAnyRateOfItsClock) {
  for (const double rate : {0.98, 0.99, 1.0, 1.01, 1.02}) {
    Robot robot(blank());
    robot.rate = rate;
    robot.hear(kBoot);
    for (std::uint8_t page = 0; page < 6; ++page) robot.hear_page(large(), page, never);
    EXPECT_EQ(robot.pages_of(large(), 6), 6) << rate;
  }
}

TEST(BootLoader, LostMessagesCostAPassAndNoPage) {
  const int pages = pages_of(large());
  Robot robot(blank());
  robot.hear(kBoot);
  std::mt19937 random(1);
  const auto lost = [&random] { return random() % 100 == 0; };
  std::vector<int> written;
  for (int pass = 0; pass < 20 && robot.in_boot_section(); ++pass) {
    robot.hear(kSize, static_cast<std::uint8_t>(pages));
    for (int page = 0; page < pages && robot.in_boot_section(); ++page)
      robot.hear_page(large(), static_cast<std::uint8_t>(page), lost);
    written.push_back(robot.pages_of(large(), pages));
  }
  ASSERT_GE(written.size(), 2u);
  // One of 22 messages is lost with probability 0.198, so that 0.802 of the pages are written; five standard deviations.
  EXPECT_NEAR(written[0], 0.802 * pages, 5 * std::sqrt(pages * 0.802 * 0.198));
  EXPECT_EQ(written.back(), pages);
  robot.hear(kRun);
  robot.mcu.run(robot.mcu.now() + kSecond / 10, {});
  EXPECT_EQ(robot.mcu.outputs().led, 0x3c);
}

TEST(BootLoader, GoesBackUponAnotherMessageUntilAPageIsWritten) {
  Robot robot(blank());
  robot.hear(kBoot);
  EXPECT_TRUE(robot.in_boot_section());
  robot.hear(kWakeup);
  EXPECT_FALSE(robot.in_boot_section());
  robot.hear(kRun);
  EXPECT_EQ(robot.mcu.outputs().led, 3) << "the blank program runs as before";
  robot.hear(kBoot);
  robot.hear_page(large(), 30, never);
  robot.hear(kWakeup);
  EXPECT_TRUE(robot.in_boot_section());
  robot.hear(kSize, 1);
  EXPECT_FALSE(robot.in_boot_section()) << "one page is all";
}

/// Neither wild page numbers nor wild offsets reach the boot section.
TEST(BootLoader, ProtectsItself) {
  Robot robot(blank());
  robot.hear(kBoot);
  std::mt19937 random(2);
  for (int n = 0; n < 400; ++n) {
    IrMessage message{};
    for (std::uint8_t& octet : message) octet = static_cast<std::uint8_t>(random());
    message[0] |= 224;
    message[9] = kPagePart;
    robot.hear(message, 1000);
  }
  EXPECT_TRUE(std::equal(blank().flash.begin(), blank().flash.end(), robot.mcu.flash().begin()));
  EXPECT_EQ(robot.mcu.halt(), Halt::kNone);
  robot.hear(kWakeup);
  robot.hear(kRun);
  EXPECT_EQ(robot.mcu.outputs().led, 3);
}

/// Pages written within a span that is repeated with other light do not stay. A checkpoint has the pages.
TEST(BootLoader, PagesGoBackWithTheProcessorAndWithIt) {
  Robot robot(blank());
  robot.hear(kBoot);
  robot.mcu.mark();
  robot.hear_page(large(), 3, never);
  EXPECT_EQ(robot.pages_of(large(), 4) - robot.pages_of(large(), 3), 1);
  robot.mcu.rewind();
  EXPECT_TRUE(std::equal(blank().flash.begin(), blank().flash.end(), robot.mcu.flash().begin()));
  robot.hear_page(large(), 5, never);
  robot.mcu.mark();
  const std::string saved = robot.mcu.save();
  Robot other(blank());
  other.mcu.load(saved);
  EXPECT_TRUE(std::equal(robot.mcu.flash().begin(), robot.mcu.flash().end(), other.mcu.flash().begin()));
  for (Robot* each : {&robot, &other}) {
    each->hear(kSize, 2);
    each->hear_page(large(), 6, never);
    EXPECT_FALSE(each->in_boot_section());
  }
  EXPECT_EQ(robot.mcu.now(), other.mcu.now());
  EXPECT_EQ(robot.mcu.program_counter(), other.mcu.program_counter());
}

TEST(BootLoader, AProgramThatNeedsItsRoomIsRefused) {
  std::string table;
  for (int i = 0; i < 28500; ++i) table += "1,";
  const std::string source =
      "#include <avr/pgmspace.h>\n" +
      whole_program("static const uint8_t table[] PROGMEM = {" + table +
                    "};\nstatic void setup(void) { set_color(pgm_read_byte(table + kilo_ticks)); }\n"
                    "static void loop(void) {}");
  EXPECT_NO_THROW(compiled(source, false));
  try {
    compiled(source, true);
    ADD_FAILURE() << "it fits";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("28 KiB"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kilotwin::firmware

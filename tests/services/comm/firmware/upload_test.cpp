// A station program's upload, from octets on the serial line to the program that the robots then run.
#include <gtest/gtest.h>

#include "clients/ohc/serial_packet.hpp"
#include "tests/services/comm/firmware/programs.hpp"
#include "tests/services/comm/firmware/timeline.hpp"

namespace kilotwin::firmware {
namespace {

namespace fs = std::filesystem;

constexpr std::uint8_t kBoot = 0x80, kSize = 0x82, kRun = 0x88;
/// From page to page, ticks: 131 ms, as KiloGUI sends them.
constexpr std::int64_t kPageTicks = 4;
constexpr std::uint32_t kBlankLed = 3, kNewLed = 0x30, kGreen = 0x0c;

/// The messages that reach a controller that reads the octets of these packets from its line.
class Line {
 public:
  void send(std::int64_t tick, const OverheadPacket& packet) {
    for (const std::uint8_t octet : ohc::encode(packet)) {
      const auto taken = decoder_.take(octet);
      if (!taken) continue;
      Directive directive;
      directive.sequence_number = directives.size();
      directive.tick = Tick{tick};
      directive.kind = DirectiveKind::kOverheadInput;
      directive.packet = *taken;
      directives.push_back(directive);
    }
  }
  void repeat(std::int64_t tick, std::uint8_t type, std::uint8_t first = 0) {
    send(tick, {OverheadCommand::kRepeat, {first, 0, 0, 0, 0, 0, 0, 0, 0, type}});
  }
  /// One pass over a program. Returns the tick after it.
  std::int64_t upload(std::int64_t tick, const FlashImage& image, int pages) {
    repeat(tick, kSize, static_cast<std::uint8_t>(pages));
    for (int page = 0; page < pages; ++page) {
      std::vector<std::uint8_t> payload{static_cast<std::uint8_t>(page)};
      const auto from = image.flash.begin() + static_cast<std::ptrdiff_t>(page) * kPageOctets;
      payload.insert(payload.end(), from, from + kPageOctets);
      OverheadPacket packet;
      packet.command = OverheadCommand::kBootPage;
      packet.set_payload(payload);
      send(tick += kPageTicks, packet);
    }
    return tick + kPageTicks;
  }

  std::vector<Directive> directives;

 private:
  ohc::PacketDecoder decoder_;
};

TEST(Upload, ReachesEmulatedRobotsThroughTheirBootLoader) {
  const fs::path folder = fs::temp_directory_path() / ("kilotwin-upload-" + std::to_string(getpid()));
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::ofstream(folder / "blank.c") << whole_program(
      "static void setup(void) { set_color(RGB(3, 0, 0)); }\nstatic void loop(void) {}");
  // 57 pages: a table in flash, whose sum says that all of it has arrived.
  std::string table;
  int sum = 0;
  for (int i = 0; i < 4700; ++i) {
    table += std::to_string(i * 37 % 251) + ",";
    sum += i * 37 % 251;
  }
  const FlashImage image =
      firmware("#include <avr/pgmspace.h>\n" +
               whole_program(
                   "static const uint8_t table[] PROGMEM = {" + table +
                   "};\nstatic void setup(void) { uint8_t sum = 0; for (uint16_t i = 0; i < sizeof table; ++i) sum "
                   "+= pgm_read_byte(table + i); set_color(sum == " +
                   std::to_string(sum % 256) + " ? RGB(0, 0, 3) : RGB(3, 3, 3)); }\nstatic void loop(void) {}"));
  const int pages = static_cast<int>(image.used_octets / kPageOctets) + 1;
  EXPECT_GE(pages, 57);

  Line line;
  line.repeat(100, kBoot);
  const std::int64_t begins = 130, ends = line.upload(begins, image, pages);
  line.repeat(ends, kRun);
  const double duration_s = static_cast<double>(ends + 20) * 0.032768;
  const Timeline timeline = run_timeline("duration_s: " + std::to_string(duration_s) +
                                             " seed: 3 robots { count: 3 avr: true behaviour: \"" +
                                             (folder / "blank.c").string() + "\" layout { grid {} } }\n",
                                         folder / "run", 2, {}, line.directives);
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  EXPECT_EQ(timeline.totals.robots_failed, 0u);
  for (const std::vector<Change>& led : timeline.led) {
    const auto shown = [&](std::uint32_t value, std::int64_t from, std::int64_t until) {
      return std::any_of(led.begin(), led.end(), [&](const Change& change) {
        return change.value == value && change.tick >= from && change.tick < until;
      });
    };
    EXPECT_TRUE(shown(kBlankLed, 0, 100)) << "the blank program runs";
    EXPECT_TRUE(shown(kGreen, begins, ends)) << "pages are written";
    ASSERT_FALSE(led.empty());
    EXPECT_EQ(led.back().value, kNewLed) << "one pass brings all pages, and the new program runs";
    EXPECT_GE(led.back().tick, ends);
  }
  RecordProperty("pages", pages);
  RecordProperty("ticks", static_cast<int>(ends - begins));
}

}  // namespace
}  // namespace kilotwin::firmware

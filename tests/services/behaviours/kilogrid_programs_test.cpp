// Programs that are written for the Kilogrid's kilolib: of robots, and of modules.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "core/base/eeprom_layout.h"
#include "core/base/error.hpp"
#include "core/base/kilogrid_cell.h"
#include "core/os/process.hpp"
#include "idl/manifest.pb.h"
#include "services/behaviours/program_text.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

/// A robot that shows the first octet of a message of type 32, and turns left at one of type TURN_LEFT.
const std::string kRobot =
    "#include <kilolib.h>\n#include <utils.h>\n#include <kilob_tracking.h>\n"
    "static tracking_user_data_t report;\n"
    "static void rx(IR_message_t* m, distance_measurement_t* d) { if (m->type == 32) set_color(m->data[0]); }\n"
    "static void setup(void) { kilob_tracking_init(); report.byte[0] = 9; }\n"
    "static void loop(void) { kilob_tracking(&report); }\n"
    "int main(void) { kilo_init(); utils_init(); utils_message_rx = rx; kilo_start(setup, loop); return 0; }\n";

/// A module whose cells say their configuration, and show what they hear.
const std::string kModule =
    "#include <module.h>\n#include <moduleIR.h>\n#include <moduleLED.h>\n#include <CAN.h>\n"
    "static void rx(IR_message_t* m, cell_num_t c, distance_measurement_t* d, uint8_t wrong) {\n"
    "  CAN_message_t* can = next_CAN_message();\n"
    "  set_LED(c, GREEN);\n"
    "  if (can) serialize_tracking_message(can, c, (tracking_user_data_t*)m->data);\n}\n"
    "static void setup(void) { for (int c = 0; c < N_CELLS; ++c) { IR_message_t m; init_IR_message(&m);\n"
    "  m.type = 32; m.data[0] = configuration[c]; m.data[1] = module_uid_x_coord; m.data[2] = configuration_size;\n"
    "  set_IR_message(&m, (cell_num_t)c); set_LED((cell_num_t)c, (color_t)configuration[c]); } }\n"
    "static void loop(void) {}\n"
    "int main(void) { module_init(); module_IR_message_rx = rx; module_start(setup, loop); return 0; }\n";

/// Index of a message's type, after nine octets of data.
constexpr std::size_t kType = 9;

/// Makes robot 0 the cell with that number of the module (3, 1), whose configuration is red, green, blue, white.
void make_cell(proto::Manifest& manifest, char number) {
  std::array<std::uint8_t, KILOTWIN_EEPROM_OCTETS> octets;
  kilotwin_fill_eeprom(octets.data(), {0, 0, 0, 0, 0});
  std::string content(octets.begin(), octets.end());
  content.replace(KILOTWIN_CELL_MODULE_X, 8, {3, 1, number, 4, 1, 2, 4, 7});
  proto::RobotEeprom& eeprom = *manifest.add_eeprom();
  eeprom.set_robot(0);
  eeprom.set_content(content);
}

TEST(KilogridPrograms, AreRecognisedByTheirNames) {
  const Folder folder;
  EXPECT_EQ(kilolib_of({folder.write("robot.c", kRobot)}), Kilolib::kKilogridRobot);
  EXPECT_EQ(kilolib_of({folder.write("module.c", kModule)}), Kilolib::kKilogridModule);
  EXPECT_EQ(kilolib_of({folder.write("plain.c", "// IR_message_t, module_init()\nmessage_t m;\n")}),
            Kilolib::kKilobot);
  EXPECT_TRUE(
      mentions(compile({folder.path() / "robot.c"}, cached()).notes, "compiled with the Kilogrid's kilolib"));
  // Headers of the program decide too, and those that they include. Copies of the library's own headers say nothing.
  folder.write("inner.h", "typedef struct { IR_message_t last; } heard_t;\n");
  folder.write("outer.h", "#include \"inner.h\"\n");
  EXPECT_EQ(kilolib_of({folder.write("split.c", "#include \"outer.h\"\n")}), Kilolib::kKilogridRobot);
  folder.write("module.h", "void module_init(void);\n");
  EXPECT_EQ(kilolib_of({folder.write("copied.c", "#include \"module.h\"\nmessage_t m;\n")}), Kilolib::kKilobot);
  // Types that only the Kilogrid has stay free for other programs.
  EXPECT_NO_THROW((void)compile({folder.write("other.c", program("enum { TRACKING, TURN_LEFT };"))}, cached()));
  CompileOptions named = cached();
  named.kilolib = "kilogrid";
  const fs::path types = folder.write("types.c", program("static void loop(void) { set_color(TRACKING); }"));
  EXPECT_THROW((void)compile({types}, cached()), UserError);
  EXPECT_NO_THROW((void)compile({types}, named));
  named.kilolib = "kilogird";
  EXPECT_THROW((void)compile({types}, named), UserError);
}

TEST(KilogridPrograms, ARobotHearsMovesAndReports) {
  Swarm swarm({kRobot}, 1);
  swarm.start();
  swarm.steps(2);
  Air air;
  air.receptions = {{0, message(32, 6)}};
  air.ask = {0};
  swarm.step(air);
  // The report was queued in the first loop and is of type TRACKING.
  const ActuationFrame offer = swarm.frame();
  ASSERT_EQ(offer.offer_robot.size(), 1u);
  EXPECT_EQ(offer.offer_message[0][kType], 0x10);
  EXPECT_EQ(offer.offer_message[0][0], 9);
  swarm.step();
  EXPECT_EQ(swarm.led(0), 6);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  air = {};
  air.receptions = {{0, message(0x7E)}};
  swarm.step(air);
  swarm.steps(3);
  EXPECT_GT(swarm.frame().motor_left[0], 0);
  EXPECT_EQ(swarm.frame().motor_right[0], 0);
}

TEST(KilogridPrograms, FunctionsOfTheProgramTakeThePlaceOfTheLibrarys) {
  Swarm swarm({"#include <kilolib.h>\n#include <utils.h>\nvoid turn_left() { set_color(5); }\nIR_message_t m;\n"
               "static void setup(void) {} static void loop(void) { turn_left(); }\n"
               "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
              1);
  swarm.start();
  swarm.steps(3);
  EXPECT_EQ(swarm.led(0), 5);
}

TEST(KilogridPrograms, ACellSaysItsOwnMessageAndShowsItsOwnColour) {
  constexpr std::array<std::uint8_t, 4> kColours{1, 2, 4, 7}, kLeds{3, 12, 48, 63};
  for (char number = 0; number < 4; ++number) {
    const auto n = static_cast<std::size_t>(number);
    Swarm swarm({kModule}, 1, 1, "", [&](proto::Manifest& manifest) { make_cell(manifest, number); });
    swarm.start();
    swarm.steps(2);
    EXPECT_EQ(swarm.led(0), kLeds[n]) << n;
    Air air;
    air.ask = {0};
    swarm.step(air);
    const ActuationFrame frame = swarm.frame();
    ASSERT_EQ(frame.offer_robot.size(), 1u) << n;
    EXPECT_EQ(frame.offer_message[0][kType], 32);
    EXPECT_EQ(frame.offer_message[0][0], kColours[n]);
    EXPECT_EQ(frame.offer_message[0][1], 3);
    EXPECT_EQ(frame.offer_message[0][2], 4);
  }
}

TEST(KilogridPrograms, ACellHearsAQuarterOfTheMessagesAndPassesThemOn) {
  Swarm swarm({kModule}, 1, 1, "", [](proto::Manifest& manifest) { make_cell(manifest, 2); });
  swarm.start();
  swarm.steps(2);
  Air air;
  air.receptions = {{0, message(0x10, 77)}};
  constexpr int kSent = 400;
  std::string log;
  for (int i = 0; i < kSent; ++i) {
    swarm.step(air);
    for (const auto& printed : swarm.hosts[0]->printed()) log += printed.text;
  }
  EXPECT_EQ(swarm.led(0), 12);
  const auto reports = std::count(log.begin(), log.end(), '\n');
  EXPECT_GT(reports, kSent / 4 - 40);
  EXPECT_LT(reports, kSent / 4 + 40);
  EXPECT_TRUE(log.starts_with("tracking 3 1 2 77 0 0 0 0 0 0\n")) << log.substr(0, 60);
}

TEST(KilogridPrograms, ARobotsProgramCompilesForTheRobot) {
  if (os::find_executable("avr-gcc").empty()) GTEST_SKIP() << "no avr-gcc";
  const Folder folder;
  EXPECT_NO_THROW((void)compile_firmware({folder.write("robot.c", kRobot)}, cached()));
  EXPECT_GT(compile_for_avr({folder.path() / "robot.c"}, cached()).flash_octets, 50u);
  EXPECT_THROW((void)compile_firmware({folder.write("module.c", kModule)}, cached()), UserError);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

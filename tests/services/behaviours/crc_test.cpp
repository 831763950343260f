// A message leaves with the CRC that its program set. Receivers drop a wrong one, as kilolib on the robot does.
#include <gtest/gtest.h>

#include "core/base/message_crc.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// Sends one kind of message; the LED counts messages heard.
std::string talker(const std::string& crc) {
  return program(
      "static message_t m = {.data = {7}};\nstatic uint8_t heard;\n"
      "static message_t* tx(void) { m.crc = " +
      crc +
      "; return &m; }\n"
      "static void rx(message_t* m, distance_measurement_t* d) { set_color(++heard); }\n");
}

Air asking(std::uint32_t robots) {
  Air air;
  for (std::uint32_t robot = 0; robot < robots; ++robot) air.ask.push_back(robot);
  return air;
}

TEST(Crc, IsThatOfTheProgram) {
  const std::uint16_t right = kilotwin_message_crc(IrMessage{7}.data());
  const struct {
    const char* text;
    std::uint16_t error;
  } kCases[] = {{"message_crc(&m)", 0}, {"0", right}, {"message_crc(&m) ^ 0x8001", 0x8001}};
  for (const auto& [text, error] : kCases) {
    Swarm swarm({talker(text)}, 2);
    swarm.start();
    swarm.step(asking(2));
    ASSERT_EQ(swarm.frame().offer_robot.size(), 2u) << text;
    EXPECT_EQ(swarm.frame().offer_crc_error, (std::vector<std::uint16_t>{error, error})) << text;
  }
}

TEST(Crc, OneWarningPerProgram) {
  Swarm wrong({talker("0"), talker("message_crc(&m)")}, 3);
  wrong.start();
  for (int i = 0; i < 5; ++i) {
    Air air = asking(6);
    air.sent = wrong.frame().offer_robot;
    wrong.step(air);
  }
  ASSERT_EQ(wrong.hosts[0]->warnings().size(), 1u);
  EXPECT_EQ(wrong.hosts[0]->warnings()[0].robot, 0u);
  EXPECT_NE(wrong.hosts[0]->warnings()[0].text.find("its message has the CRC 0x0000 instead of 0x"),
            std::string::npos);
}

TEST(Crc, AReceiverDropsAWrongOne) {
  Swarm swarm({talker("0")}, 1);
  swarm.start();
  Air air;
  air.receptions = {{0, message(0, 7)}, {0, message(0, 7), 400, 300, 1}, {0, message(0, 8)}};
  swarm.step(air);
  EXPECT_EQ(swarm.led(0), 2);
  air.receptions = {{0, message(kReset), 400, 300, 0x100}};
  swarm.step(air);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kRunning) << "a command with a wrong CRC is none";
  EXPECT_EQ(swarm.led(0), 2);
}

/// kilolib's strength of the signal is that of the last message, whether its CRC was right or not.
TEST(Crc, AWrongOneUsesUpAStaleReading) {
  Swarm swarm({program("static void loop(void) { static uint8_t once; if (!once) { once = 1; get_voltage(); } }\n"
                       "static void rx(message_t* m, distance_measurement_t* d) { set_color(d->high_gain == 400 ? "
                       "RGB(0, 3, 0) : RGB(3, 0, 0)); }\n")},
              2);
  swarm.start();
  Air air;
  air.receptions = {{0, message(0)}, {1, message(0), 400, 300, 1}, {1, message(0)}};
  swarm.step(air);
  EXPECT_EQ(swarm.led(0), 3) << "the battery's voltage in place of the strength";
  EXPECT_EQ(swarm.led(1), 12);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

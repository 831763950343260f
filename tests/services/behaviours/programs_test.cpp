// The programs in behaviours/ behave as documented.
#include <gtest/gtest.h>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

bool moves(const ActuationFrame& frame, std::uint32_t robot) {
  return frame.motor_left[robot] != 0 || frame.motor_right[robot] != 0;
}

TEST(Programs, DisperseMovesWhileSomebodyIsNear) {
  Swarm swarm({ready_made("disperse.c")}, 2);
  swarm.start();
  swarm.steps(3);
  EXPECT_EQ(swarm.led(0), kGreen);
  EXPECT_FALSE(moves(swarm.frame(), 0));
  Air near;
  near.receptions = {{0, message(0), 713, 527}};  // 49 mm
  swarm.step(near);
  ActuationFrame frame = swarm.frame();
  EXPECT_EQ(frame.led[0], kRed);
  swarm.step();
  frame = swarm.frame();
  EXPECT_TRUE(moves(frame, 0));
  EXPECT_LE(std::max(frame.motor_left[0], frame.motor_right[0]), 70);
  EXPECT_FALSE(moves(frame, 1));
  swarm.steps(40);
  EXPECT_EQ(swarm.led(0), kGreen);
  EXPECT_FALSE(moves(swarm.frame(), 0));
  Air far;
  far.receptions = {{0, message(0), 281, 208}};  // 78 mm
  swarm.step(far);
  EXPECT_EQ(swarm.led(0), kGreen);
}

/// The station's reading for one robot, in slot `slot` of a packed message.
Air reading(std::uint32_t robot, unsigned slot, unsigned type, unsigned data) {
  IrMessage packed{0xFF, 0xC0, 0, 0xFF, 0xC0, 0, 0xFF, 0xC0, 0, 0};
  packed[3 * slot] = static_cast<std::uint8_t>(robot >> 2);
  packed[3 * slot + 1] = static_cast<std::uint8_t>((robot & 3) << 6 | type << 2 | data >> 8);
  packed[3 * slot + 2] = static_cast<std::uint8_t>(data & 0xFF);
  Air air;
  for (std::uint32_t receiver = 0; receiver < 6; ++receiver) air.receptions.push_back({receiver, packed});
  return air;
}

TEST(Programs, ArkHubTurnsTowardsTheHubAndStopsInside) {
  Swarm swarm({ready_made("ark_hub.c")}, 6);
  swarm.start();
  EXPECT_EQ(swarm.led(5), 0);
  swarm.step(reading(5, 1, 0, 90));
  swarm.step();
  EXPECT_EQ(swarm.led(5), kBlue);
  EXPECT_EQ(swarm.frame().motor_left[5], 60);  // the hub is to the left
  EXPECT_EQ(swarm.frame().motor_right[5], 0);
  EXPECT_FALSE(moves(swarm.frame(), 4));
  swarm.step(reading(5, 2, 0, 300));
  swarm.step();
  EXPECT_EQ(swarm.frame().motor_left[5], 0);
  EXPECT_EQ(swarm.frame().motor_right[5], 60);
  swarm.step(reading(5, 0, 0, 350));
  swarm.step();
  EXPECT_EQ(swarm.frame().motor_left[5], 70);
  EXPECT_EQ(swarm.frame().motor_right[5], 70);
  swarm.step(reading(5, 0, 1, 350));
  EXPECT_EQ(swarm.led(5), kGreen);
  EXPECT_FALSE(moves(swarm.frame(), 5));
}

TEST(Programs, BlinkGoesThroughItsColours) {
  Swarm swarm({ready_made("blink.c")}, 1);
  swarm.start();
  std::vector<std::uint8_t> colours{swarm.led(0)};
  for (int k = 0; k < 60; ++k) {
    swarm.step();
    if (swarm.led(0) != colours.back()) colours.push_back(swarm.led(0));
  }
  EXPECT_EQ(colours, (std::vector<std::uint8_t>{0x01, 0x04, 0x10, 0x01, 0x04}));
}

TEST(Programs, WalkTurnsAfterTenSeconds) {
  Swarm swarm({ready_made("walk.c")}, 1);
  swarm.start();
  swarm.steps(300);
  EXPECT_EQ(swarm.frame().motor_right[0], 70);
  swarm.steps(20);
  EXPECT_EQ(swarm.frame().motor_left[0], 60);
  EXPECT_EQ(swarm.frame().motor_right[0], 0);
  swarm.steps(62);
  EXPECT_EQ(swarm.frame().motor_right[0], 70);
}

TEST(Programs, DelayWalkCountsItsSides) {
  Swarm swarm({ready_made("delay_walk.c")}, 1);
  swarm.start();
  // A side takes 15 + 3000 + 250 + 15 + 1900 ms = 158.08 ticks.
  swarm.steps(158 * 3 + 3);
  Air ask;
  ask.ask = {0};
  swarm.step(ask);
  EXPECT_EQ(swarm.frame().offer_message.at(0)[0], 3);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

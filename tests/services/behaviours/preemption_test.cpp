// Programs that do not return from loop() within a tick: they wait, or are preempted and continue in the next tick.
#include <gtest/gtest.h>

#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// A program that waits for a message with `wait` and counts in its left motor.
void waits_for_a_message(const std::string& wait) {
  Swarm swarm({program("static uint8_t received; static uint8_t n;\n"
                       "static void rx(message_t* m, distance_measurement_t* d) { received = 1; }\n"
                       "static void loop(void) { " +
                       wait + " received = 0; set_motors(++n, 0); }")},
              3);
  swarm.start();
  for (int round = 1; round <= 5; ++round) {
    swarm.steps(100);
    EXPECT_EQ(swarm.frame().motor_left[2], round - 1) << wait;
    swarm.step(to_all(swarm, message(0)));
    EXPECT_EQ(swarm.frame().motor_left[2], round) << wait;
  }
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
}

TEST(Preemption, BusyWaitsForAMessage) {
  waits_for_a_message("while (!received);");
  waits_for_a_message("while (received == 0) {}");
  waits_for_a_message("do {} while (!received);");
  waits_for_a_message("for (; !received;) {}");
  waits_for_a_message("again: if (!received) goto again;");
  waits_for_a_message("for (;;) { if (received) break; }");
  waits_for_a_message("while (!received) set_color(RGB(1, 0, 0));");
  waits_for_a_message("volatile uint32_t rounds = 0; while (!received) ++rounds;");
  waits_for_a_message("while (!received) for (volatile int i = 0; i < 20; ++i) {}");
  waits_for_a_message("while (!received) delay(1);");
}

TEST(Preemption, BusyWaitsForTheClock) {
  Swarm swarm(
      {program("static uint8_t n; static void loop(void) { uint32_t t = kilo_ticks + 4; while (kilo_ticks < t);\n"
               "  set_motors(++n, 0); }")},
      1);
  swarm.start();
  swarm.steps(400);
  EXPECT_EQ(swarm.frame().motor_left[0], 100);
}

TEST(Preemption, AtAnyOptimisation) {
  for (const std::string level : {"O0", "O1", "O3", "Os"}) {
    SCOPED_TRACE(level);
    Swarm swarm({program("#pragma GCC optimize(\"" + level +
                         "\")\n"
                         "static uint8_t received, n; static uint32_t counter;\n"
                         "static void rx(message_t* m, distance_measurement_t* d) { received = 1; }\n"
                         "static void loop(void) {\n"
                         "  if (kilo_uid == 0) { while (!received); received = 0; }\n"
                         "  if (kilo_uid == 1) { uint32_t t = kilo_ticks + 9; while (kilo_ticks < t); }\n"
                         "  if (kilo_uid == 2) for (;;) {}\n"
                         "  if (kilo_uid == 3) for (;;) ++counter;\n"
                         "  set_motors(++n, 0); }")},
                4);
    swarm.start();
    for (int k = 2; k <= 90; ++k) swarm.step(k % 10 == 0 ? to_all(swarm, message(0)) : Air());
    EXPECT_EQ(swarm.frame().motor_left[0], 9);
    EXPECT_EQ(swarm.frame().motor_left[1], 9);
    EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kRunning);
    EXPECT_EQ(swarm.life_cycle(2), LifeCycle::kFailed);
    EXPECT_EQ(swarm.life_cycle(3), LifeCycle::kFailed);
    EXPECT_EQ(swarm.hosts[0]->robots_failed(), 2u);
  }
}

TEST(Preemption, LoopAsOnTheRobotRunsAsOftenAsItsCyclesAllow) {
  // 262144 cycles a tick; each round takes 1000 in a delay, and little more in code.
  Swarm swarm({program("#include <util/delay.h>\nstatic uint16_t n; static void loop(void) { _delay_us(125); ++n;\n"
                       "  set_motors(n & 0xff, n >> 8); }")},
              1, 1, "", [](proto::Manifest& manifest) {
                manifest.mutable_experiment()->mutable_robots(0)->set_loop_rate(proto::RobotGroup::AS_ON_ROBOT);
              });
  swarm.start();
  swarm.steps(9);
  const ActuationFrame frame = swarm.frame();
  const int rounds = frame.motor_left[0] | frame.motor_right[0] << 8;
  EXPECT_GT(rounds, 10 * 262 * 0.9);
  EXPECT_LT(rounds, 10 * 262.2);
}

TEST(Preemption, LongComputationsContinueInLaterTicks) {
  // About ten million cycles, or forty ticks. Callbacks run meanwhile.
  Swarm swarm(
      {program("uint8_t heard; volatile float sum;\n"
               "static void rx(message_t* m, distance_measurement_t* d) { set_color(++heard & 3); }\n"
               "static void loop(void) { for (uint32_t i = 0; i < 50000; ++i) sum += 1.0f / (float)(i + 1);\n"
               "  set_motors(sum > 10 && sum < 12, 0); for (;;) delay(100); }")},
      2);
  swarm.start();
  int ticks = 0;
  while (swarm.frame().motor_left[1] == 0 && ticks < 400) {
    swarm.step(to_all(swarm, message(0)));
    ++ticks;
    EXPECT_EQ(swarm.led(1), ticks & 3);
  }
  EXPECT_GT(ticks, 20);
  EXPECT_LT(ticks, 300);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

// loop() as often as on the robot: calls that change nothing are skipped, all others are not.
#include <gtest/gtest.h>

#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// A swarm of one robot with the default loop_rate.
struct Robot : Swarm {
  explicit Robot(const std::string& body)
      : Swarm({program(body)}, 1, 1, "", [](proto::Manifest& manifest) {
          manifest.mutable_experiment()->mutable_robots(0)->clear_loop_rate();
        }) {
    start();
  }
};

TEST(LoopRate, ACountThatSettlesTakesOneTick) {
  Robot robot(
      "static uint8_t count, rounds; static uint32_t since;\n"
      "static void setup(void) { since = kilo_ticks; }\n"
      "static void loop(void) { if (kilo_ticks - since < 10) return; if (++count < 50) return;\n"
      "  count = 0; since = kilo_ticks; set_motors(++rounds, 0); }\n");
  const int before = robot.frame().motor_left[0];
  robot.steps(100);
  EXPECT_EQ(robot.frame().motor_left[0] - before, 10);
}

/// Calls of a loop() that counts them and then does this, per tick of 262144 cycles.
double calls_per_tick(const std::string& statement, const std::string& before = "") {
  Robot robot(before +
              "static uint32_t n; static message_t m, other; static volatile uint16_t v;\n"
              "static message_t* tx(void) { memcpy(m.data, &n, 4); return &m; }\n"
              "static void loop(void) { ++n; " +
              statement + " }\n");
  constexpr int kTicks = 20;
  robot.steps(kTicks);
  Air air;
  air.ask = {0};
  robot.step(air);
  const IrMessage sent = robot.frame().offer_message.at(0);
  return (sent[0] | sent[1] << 8 | sent[2] << 16) / (kTicks + 1.5);
}

TEST(LoopRate, CallsThatChangeSomethingAreAllExecuted) {
  // As firmware a call of ++n takes 47 cycles.
  EXPECT_NEAR(calls_per_tick(""), 262144 / 47, 0.25 * 262144 / 47);
}

TEST(LoopRate, TextThatNobodyReadsTakesNoTime) {
  // As on the robot, where printf() returns at once before debug_init().
  const std::string print = "printf(\"%d: %ld of %ld\\n\", 1234, (long)n, (long)n);";
  const double plain = 262144 / calls_per_tick("", "#include <stdio.h>\n");
  const double printed = 262144 / calls_per_tick(print, "#include <stdio.h>\n") - plain;
  EXPECT_GT(printed, 60);
  EXPECT_LT(printed, 250);  // with the arguments
  const std::string serial = "#define DEBUG\n#include \"debug.h\"\nstatic void setup(void) { debug_init(); }\n";
  EXPECT_GT(262144 / calls_per_tick(print, serial), 15 * 2083);  // a line of 17 octets at 38400 baud
}

TEST(LoopRate, FunctionsOfKilolibTakeTheirTime) {
  const double plain = 262144 / calls_per_tick("");
  const auto cycles = [&](const std::string& statement) { return 262144 / calls_per_tick(statement) - plain; };
  EXPECT_NEAR(cycles("set_motors(n, n);"), 20, 15);
  EXPECT_NEAR(cycles("v = message_crc(&other);"), 400, 60);
  EXPECT_NEAR(cycles("v = rand();"), 815, 80);
  EXPECT_NEAR(cycles("v = kilo_ticks / 800;"), 620, 60);
  EXPECT_NEAR(cycles("v = v / 10;"), 220, 40);
}

/// The share of requests at which kilo_message_tx finds `busy` set, in 600 requests.
double busy_share(const std::string& loop) {
  Robot robot(
      "static volatile uint8_t busy; static volatile uint16_t v; static message_t m;\n"
      "static message_t* tx(void) { return busy ? NULL : &m; }\n"
      "static void loop(void) { " +
      loop + " }\n");
  constexpr int kRequests = 600;
  int offers = 0;
  Air air;
  air.ask = {0};
  for (int k = 0; k < kRequests; ++k) {
    robot.step(air);
    const bool offers_now = !robot.frame().offer_robot.empty();
    offers += offers_now ? 1 : 0;
    air.sent.clear();
    if (offers_now) air.sent = {0};
  }
  return 1 - offers / double{kRequests};
}

TEST(LoopRate, AMessageIsAskedForAtAnyPlaceOfACallThatChangesNothing) {
  // On a robot the callback interrupts loop(): it finds each place as often as the program is there.
  const std::string wait = "for (uint16_t i = 0; i < 300; ++i) v = 0;";
  EXPECT_EQ(busy_share(wait), 0);
  EXPECT_EQ(busy_share("busy = 1; v = 0; busy = 0; " + wait), 0) << "too short to be interrupted";
  // Five standard deviations of 600 requests are 0.1.
  EXPECT_NEAR(busy_share("busy = 1; " + wait + " busy = 0; " + wait), 0.5, 0.1);
  EXPECT_NEAR(busy_share("busy = 1; " + wait + " busy = 0; " + wait + wait + wait), 0.25, 0.1);
}

TEST(LoopRate, AMessageIsAskedForWithinStraightCode) {
  // Neither a loop nor a function begins between the two assignments.
  std::string divisions;
  for (const int divisor : {7, 11, 13, 17, 19, 23, 29, 31})
    divisions += "v = (uint16_t)(v + 60000u) / " + std::to_string(divisor) + "; ";
  EXPECT_NEAR(busy_share("busy = 1; " + divisions + "busy = 0; " + divisions), 0.5, 0.1);
  EXPECT_NEAR(busy_share("busy = 1; " + divisions + "busy = 0; " + divisions + divisions + divisions), 0.25, 0.1);
}

TEST(LoopRate, ADelayThatTheCallbackCausesLasts) {
  // kilo_message_tx interrupts a call that changes nothing. The call then waits for half a second: 15.3 ticks.
  Robot robot(
      "static volatile uint8_t asked; static uint8_t waits; static volatile uint16_t v;\n"
      "static message_t* tx(void) { asked = 1; return NULL; }\n"
      "static void loop(void) { for (uint16_t i = 0; i < 300; ++i) v = 0;\n"
      "  if (asked) { asked = 0; delay(500); set_motors(++waits, 0); }\n"
      "  for (uint16_t i = 0; i < 300; ++i) v = 0; }\n");
  robot.steps(10);
  Air asking;
  asking.ask = {0};
  for (int request = 0; request < 20; ++request) {
    const int before = robot.frame().motor_left[0];
    robot.step(asking);
    int ticks = 0;
    for (; robot.frame().motor_left[0] == before && ticks < 30; ++ticks) robot.step();
    EXPECT_GE(ticks, 15);
    EXPECT_LE(ticks, 17);
    robot.steps(5);
  }
}

TEST(LoopRate, MessagesAreSeenOnceEach) {
  Robot robot(
      "static volatile uint8_t is_new; static uint8_t n;\n"
      "static void rx(message_t* m, distance_measurement_t* d) { is_new = 1; }\n"
      "static void loop(void) { if (!is_new) return; is_new = 0; set_motors(++n, 0); }\n");
  for (int k = 1; k <= 100; ++k) {
    Air air;
    if (k % 3 == 0) air.receptions = {{0, message(0)}};
    robot.step(air);
    EXPECT_EQ(robot.frame().motor_left[0], k / 3);
  }
}

TEST(LoopRate, TheClockIsSeenInItsTick) {
  Robot robot("static void loop(void) { set_motors(kilo_ticks & 255, kilo_ticks / 7 & 255); }\n");
  const int first = robot.frame().motor_left[0];
  for (int k = 1; k <= 100; ++k) {
    robot.step();
    EXPECT_EQ(robot.frame().motor_left[0], (first + k) & 255);
  }
}

TEST(LoopRate, FlashesWithinATickAreSeenAsOftenAsTheyLast) {
  // A flash of 20 ms per message, in ticks of 32.8 ms.
  Robot robot(
      "static volatile uint8_t is_new;\n"
      "static void rx(message_t* m, distance_measurement_t* d) { is_new = 1; }\n"
      "static void loop(void) { if (!is_new) return; is_new = 0; set_color(3); delay(20); set_color(0); }\n");
  constexpr int kTicks = 400;
  int seen = 0;
  for (int k = 0; k < kTicks; ++k) {
    Air air;
    air.receptions = {{0, message(0)}};
    robot.step(air);
    seen += robot.led(0) != 0 ? 1 : 0;
  }
  EXPECT_NEAR(seen / double{kTicks}, 20 / 32.77, 0.08);
}

/// A parked program is not called any more: the sample of its last tick must not stay.
TEST(LoopRate, RobotsThatParkInTheTickOfAFlashShowTheirLastColour) {
  // main() ends a moment after the flash, at another time of the tick in each robot.
  constexpr std::uint32_t kRobots = 24;
  Swarm swarm(
      {"#include <kilolib.h>\n"
       "int main(void) { kilo_init(); delay(200 + 3 * kilo_uid); set_color(3); delay(10); set_color(0); }\n"},
      kRobots, 1, "",
      [](proto::Manifest& manifest) { manifest.mutable_experiment()->mutable_robots(0)->clear_loop_rate(); });
  int flashes = 0;
  for (int k = 0; k < 20; ++k) {
    swarm.step();
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) flashes += swarm.led(robot) != 0 ? 1 : 0;
  }
  EXPECT_GT(flashes, 0) << "flashes are seen as often as they last";
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) EXPECT_EQ(swarm.led(robot), 0) << robot;
}

TEST(LoopRate, DelaysKeepTheirTime) {
  // Two states that are equal before and after each call: their delays must not be skipped.
  Robot robot("static void loop(void) { set_color(1); delay(500); set_color(0); delay(500); }\n");
  int changes = 0;
  std::uint8_t last = robot.led(0);
  constexpr int kTicks = 3052;  // 100 s
  for (int k = 0; k < kTicks; ++k) {
    robot.step();
    changes += robot.led(0) != last ? 1 : 0;
    last = robot.led(0);
  }
  EXPECT_NEAR(changes, 200, 2);
}

TEST(LoopRate, PeriodsOfSeveralCallsAreCutShort) {
  // Three colours in turn, then again from the first: the state repeats after three calls.
  Robot robot(
      "static uint8_t i; static void loop(void) { i = (i + 1) % 3; set_color(i + 1); set_motors(7, 8); }\n");
  for (int k = 0; k < 50; ++k) {
    robot.step();
    EXPECT_GE(robot.led(0), 1);
    EXPECT_LE(robot.led(0), 3);
    EXPECT_EQ(robot.frame().motor_right[0], 8);
  }
}

TEST(LoopRate, PrintedTextIsNotSkipped) {
  Robot robot(
      "#define DEBUG\n#include \"debug.h\"\n"
      "static void loop(void) { printf(\"x\"); delay(1); }\n");
  robot.step();
  EXPECT_GT(robot.hosts[0]->printed().size(), 0u);
  std::size_t octets = 0;
  for (const auto& printed : robot.hosts[0]->printed()) octets += printed.text.size();
  EXPECT_GE(octets, 20u);
}

/// The warnings for a swarm of two robots with this loop() within ten seconds.
std::vector<std::string> warned(const std::string& loop, bool as_on_robot) {
  Swarm swarm({program("static uint32_t n;\nstatic void loop(void) { " + loop + " }\n")}, 2, 1, "",
              [&](proto::Manifest& manifest) {
                if (as_on_robot) manifest.mutable_experiment()->mutable_robots(0)->clear_loop_rate();
              });
  swarm.start();
  swarm.steps(310);
  std::vector<std::string> texts;
  for (const auto& warning : swarm.hosts[0]->warnings()) texts.push_back(warning.text);
  return texts;
}

TEST(LoopRate, ProgramsThatAreSlowToSimulateAreNamedOnce) {
  const std::vector<std::string> counts = warned("++n;", true);
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_NE(counts[0].find("so each is simulated, more than "), std::string::npos) << counts[0];
  EXPECT_EQ(warned("n = kilo_ticks;", true), std::vector<std::string>{});
  EXPECT_EQ(warned("++n; delay(1);", true), std::vector<std::string>{}) << "its calls take time";
}

TEST(LoopRate, ProgramsWhoseNumberOfCallsMattersAreNamedOnce) {
  const std::vector<std::string> counts = warned("++n;", false);
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_NE(counts[0].find("times per tick, here once"), std::string::npos) << counts[0];
  EXPECT_EQ(warned("n = kilo_ticks;", false), std::vector<std::string>{});
}

}  // namespace
}  // namespace kilotwin::behaviours::test

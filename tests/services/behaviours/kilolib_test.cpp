// kilolib and the C library as programs see them. A program reports numbers through the messages that it sends.
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "core/base/spin_up.hpp"
#include "core/math/elementary.h"
#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// Robot 0's message if the radio requests one in this tick.
IrMessage asked(Swarm& swarm) {
  Air air;
  air.ask = {0};
  swarm.step(air);
  const ActuationFrame frame = swarm.frame();
  EXPECT_EQ(frame.offer_robot, std::vector<std::uint32_t>{0});
  return frame.offer_message.at(0);
}

/// Runs `statements` in setup(), which fill report[0..8], and returns them.
IrMessage report(const std::string& statements, const std::string& before = "") {
  Swarm swarm({program(before + "\nstatic message_t m;\nstatic void setup(void) {\n uint8_t* report = m.data;\n" +
                       statements + "\n}\nstatic message_t* tx(void) { return &m; }\n")},
              1);
  swarm.start();
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
  return asked(swarm);
}

std::uint16_t word(const IrMessage& message, std::size_t i) {
  return static_cast<std::uint16_t>(message[i] | message[i + 1] << 8);
}

TEST(Kilolib, ChecksumsAreThoseOfTheFirmware) {
  const IrMessage r = report(
      "message_t x; memset(&x, 0, sizeof x); uint16_t c = message_crc(&x); memcpy(report, &c, 2);\n"
      "x.type = RUN; c = message_crc(&x); memcpy(report + 2, &c, 2);\n"
      "x.type = RESET; c = message_crc(&x); memcpy(report + 4, &c, 2);\n"
      "report[6] = sizeof(message_t); report[7] = sizeof(enum { A, B }); report[8] = sizeof(struct { char a; "
      "int32_t b; });");
  EXPECT_EQ(word(r, 0), 0x9C87);
  EXPECT_EQ(word(r, 2), 0x94C7);
  EXPECT_EQ(word(r, 4), 0x2A14);
  EXPECT_EQ(r[6], 12);
  EXPECT_EQ(r[7], 1);
  EXPECT_EQ(r[8], 5);
}

/// Steps as on the robot; the sum of the times at full duty, in spin-ups, and the last duty of the left motor.
std::pair<double, int> full_duty(const std::string& loop, int ticks) {
  Swarm swarm({program(loop)}, 1, 1, "", [](proto::Manifest& manifest) {
    manifest.mutable_experiment()->mutable_robots(0)->clear_loop_rate();
  });
  swarm.start();
  double sum = 0;
  for (int k = 0; k < ticks; ++k) {
    swarm.step();
    const ActuationFrame frame = swarm.frame();
    const bool throughout = frame.spin_up[0] == kFullDuty || frame.motor_left[0] == 255;
    sum += throughout ? 262144.0 / 120000 : frame.spin_up[0] / 100.0;
  }
  return {sum, swarm.frame().motor_left[0]};
}

TEST(Kilolib, TimeAtFullDutyIsCountedToTheCycle) {
  constexpr double kWhole = 262144.0 / 120000;  // spin-ups in a tick
  const auto [always, shown] = full_duty("static void loop(void) { spinup_motors(); set_motors(70, 0); }\n", 100);
  EXPECT_NEAR(always, 100 * kWhole, 0.02 * 100) << "one after the other";
  EXPECT_EQ(shown, 70);
  const auto [often, steps] =
      full_duty("static void loop(void) { spinup_motors(); set_motors(70, 70); delay(45); }\n", 610);
  EXPECT_NEAR(often, 610 * 32.768 / 60, 2) << "15 of 60 ms, across the ends of ticks";
  EXPECT_EQ(steps, 70);
  const auto [by_hand, after] = full_duty(
      "static void loop(void) { set_motors(255, 255); delay(15); set_motors(70, 70); delay(45); }\n", 610);
  EXPECT_NEAR(by_hand, often, 2);
  EXPECT_EQ(after, 70);
  const auto [once, later] =
      full_duty("static void loop(void) { if (kilo_ticks == 20) spinup_motors(); set_motors(1, 2); }\n", 100);
  EXPECT_GE(once, 1);
  EXPECT_LE(once, 1 + kWhole) << "as often as fits into that tick";
  EXPECT_EQ(later, 1);
}

TEST(Kilolib, ASpinUpThatGoesOnShowsTheDutiesBeforeIt) {
  Swarm swarm({program("static void loop(void) { set_motors(70, 0); delay(25); spinup_motors(); set_motors(0, 70); "
                       "delay(10000); }\n")},
              1);
  swarm.start();
  swarm.steps(4);
  const ActuationFrame frame = swarm.frame();
  EXPECT_EQ(frame.motor_right[0], 70);
  EXPECT_EQ(frame.motor_left[0], 0);
}

TEST(Kilolib, DutiesWithinATickAreShownAsLongAsTheyHold) {
  // Each tick begins with the left motor and ends with both at rest.
  Swarm swarm({program("static void loop(void) { uint32_t t = kilo_ticks; set_motors(70, 0); delay(10); "
                       "set_motors(0, 0); while (kilo_ticks == t); }\n")},
              1, 1, "", [](proto::Manifest& manifest) {
                manifest.mutable_experiment()->mutable_robots(0)->clear_loop_rate();
              });
  swarm.start();
  constexpr int kTicks = 600;
  int shown = 0;
  for (int k = 0; k < kTicks; ++k) {
    swarm.step();
    shown += swarm.frame().motor_left[0] == 70 ? 1 : 0;
  }
  EXPECT_NEAR(shown, kTicks * 10 / 32.768, 3);
}

TEST(Kilolib, ReceivedMessagesCarryTheirChecksum) {
  Swarm swarm(
      {program("static void rx(message_t* m, distance_measurement_t* d) {\n"
               "  if (m->crc == message_crc(m) && m->crc == 0x9C87 && d->high_gain == 400 && d->low_gain == 300)\n"
               "    set_color(RGB(0, 3, 0));\n}\n")},
      1);
  swarm.start();
  Air air;
  air.receptions = {{0, message(0)}};
  swarm.step(air);
  EXPECT_EQ(swarm.led(0), 0x0C);
}

/// On a robot no push can come between kilo_message_tx and kilo_message_tx_success: interrupts are off meanwhile.
TEST(Kilolib, APushIntoTheFullRingLosesNoMessageThatWaits) {
  Swarm swarm({"#define TXBUFFER_SIZE 2\n#include <kilolib.h>\n#include <message_buffered.h>\n"
               "static void put(uint8_t n) { message_t m = {{n}, NORMAL, 0}; m.crc = message_crc(&m); "
               "txbuffer_push(&m); }\n"
               "static void setup(void) { put(1); put(2); }\n"
               "static void loop(void) { distance_measurement_t d; if (!rxbuffer_peek(&d)) return; rxbuffer_pop(); "
               "put(3); }\n"
               "int main(void) { kilo_init(); kilo_message_buffered(); kilo_start(setup, loop); return 0; }\n"},
              1);
  swarm.start();
  EXPECT_EQ(asked(swarm)[0], 1);
  Air air;
  air.receptions = {{0, message(0)}};
  swarm.step(air);  // the program pushes 3, and the ring drops 1, which the radio is sending
  for (const int next : {2, 3}) {
    air = Air();
    air.sent = {0};
    swarm.step(air);
    EXPECT_EQ(asked(swarm)[0], next);
  }
}

TEST(Kilolib, SoftRandomNumbersAreThoseOfTheFirmware) {
  const IrMessage r = report("for (int i = 0; i < 9; ++i) report[i] = rand_soft();");
  std::uint8_t seed = 0xAA, accumulator = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    seed = static_cast<std::uint8_t>(seed ^ seed << 3);
    seed = static_cast<std::uint8_t>(seed ^ seed >> 5);
    seed = static_cast<std::uint8_t>(seed ^ accumulator++ >> 2);
    EXPECT_EQ(r[i], seed) << i;
  }
}

TEST(Kilolib, HardRandomNumbersDifferBetweenRobotsAndNotBetweenRuns) {
  const std::string text = program(
      "static message_t m;\nstatic void setup(void) { for (int i = 0; i < 9; ++i) m.data[i] = rand_hard(); }\n"
      "static message_t* tx(void) { return &m; }\n");
  std::array<ActuationFrame, 2> frames;
  for (ActuationFrame& frame : frames) {
    Swarm swarm({text}, 2);
    swarm.start();
    Air air;
    air.ask = {0, 1};
    swarm.step(air);
    frame = swarm.frame();
  }
  ASSERT_EQ(frames[0].offer_message.size(), 2u);
  EXPECT_EQ(frames[0].offer_message, frames[1].offer_message);
  EXPECT_NE(frames[0].offer_message[0], frames[0].offer_message[1]);
}

TEST(Kilolib, RandIsThatOfAvrLibc) {
  // x = 16807 x mod 2^31 - 1 from 1: 16807, 282475249, 1622650073, 984943658; rand() gives them mod 2^15.
  const IrMessage r = report(
      "for (int i = 0; i < 4; ++i) { uint16_t x = rand(); memcpy(report + 2 * i, &x, 2); }\n"
      "srand(1); report[8] = rand() == 16807;");
  EXPECT_EQ(word(r, 0), 16807 % 32768);
  EXPECT_EQ(word(r, 2), 282475249 % 32768);
  EXPECT_EQ(word(r, 4), 1622650073 % 32768);
  EXPECT_EQ(word(r, 6), 984943658 % 32768);
  EXPECT_EQ(r[8], 1);
}

TEST(Kilolib, EstimatesTheMeasuredDistance) {
  const IrMessage r = report(
      "distance_measurement_t d = {527, 713}; report[0] = estimate_distance(&d);\n"
      "d.low_gain = 900; d.high_gain = 1000; report[1] = estimate_distance(&d);\n"
      "d.low_gain = 100; d.high_gain = 950; report[2] = estimate_distance(&d);\n"
      "d.low_gain = 0; d.high_gain = 330; report[3] = estimate_distance(&d);\n"
      "d.high_gain = 100; report[4] = estimate_distance(&d);\n"
      "d.high_gain = 148; report[5] = estimate_distance(&d);");
  EXPECT_EQ(r[0], 49);       // measured: 713/527 at 49 mm
  EXPECT_EQ(r[1], 33);       // touching
  EXPECT_EQ(r[2], 33 + 90);  // beyond the low-gain table
  EXPECT_EQ(r[3], 33 + 40);  // an entry of the table
  EXPECT_EQ(r[4], 33 + 74);  // beyond the last entry, along the last segment
  EXPECT_EQ(r[5], 33 + 65);  // the last entry
}

TEST(Kilolib, CalibrationAndIdentityAreTheRobotsOwn) {
  const IrMessage r = report(
      "report[0] = kilo_uid; report[1] = kilo_straight_left; report[2] = kilo_straight_right;\n"
      "report[3] = kilo_turn_left; report[4] = kilo_turn_right; uint16_t p = kilo_tx_period;\n"
      "memcpy(report + 5, &p, 2); report[7] = get_voltage() > 682; report[8] = kilo_irhigh[2] == 864;",
      "extern uint16_t kilo_irhigh[14];");
  EXPECT_EQ(r[0], 0);
  EXPECT_EQ(r[1], 70);
  EXPECT_EQ(r[2], 70);
  EXPECT_EQ(r[3], 60);
  EXPECT_EQ(r[4], 60);
  EXPECT_EQ(word(r, 5), 3906);
  EXPECT_EQ(r[7], 1);
  EXPECT_EQ(r[8], 1);
}

TEST(Kilolib, MathematicsAreThoseOfCoreMath) {
  const IrMessage r = report(
      "volatile double x = 1.2345; double y = sin(x); memcpy(report, &y, 8); report[8] =\n"
      "round(-2.5) == -3 && floor(-0.5) == -1 && ceil(0.2) == 1 && sqrt(2.25) == 1.5 && fabs(-x) == x\n"
      "&& trunc(-1.7) == -1 && lround(1.5) == 2 && atan2f(1, 1) == (float)M_PI_4 && fmod(7, 4) == 3;",
      "#include <math.h>");
  double y = 0;
  std::memcpy(&y, r.data(), sizeof y);
  EXPECT_EQ(y, kt_sin(1.2345));
  EXPECT_EQ(r[8], 1);
}

TEST(Kilolib, CLibraryFormatsSortsAndSearches) {
  const IrMessage r = report(
      "char text[40]; int n = snprintf(text, sizeof text, \"%d|%5u|%-3d|%04x|%s|%c|%.2f|%+d%%\", -7, 42u, 5, "
      "0xBEu, \"ab\", 'z',\n"
      "  3.14159, 9);\n"
      "report[0] = strcmp(text, \"-7|   42|5  |00be|ab|z|3.14|+9%\") == 0; report[1] = n == (int)strlen(text);\n"
      "int v[5] = {3, 1, 2, -5, 1}; qsort(v, 5, sizeof v[0], order);\n"
      "report[2] = v[0] == -5 && v[1] == 1 && v[2] == 1 && v[3] == 2 && v[4] == 3;\n"
      "int key = 2; report[3] = bsearch(&key, v, 5, sizeof v[0], order) == &v[3];\n"
      "memmove(text + 1, \"-7|\" - 0 ? text : 0, 5); report[4] = memcmp(text, \"--7|  \", 6) == 0;\n"
      "report[5] = strstr(\"kilobot\", \"bot\") != 0 && strchr(\"abc\", 'd') == 0 && atoi(\" -12x\") == -12;\n"
      "report[6] = snprintf(text, 4, \"%d\", 123456) == 6 && strcmp(text, \"123\") == 0; printf(\"dropped %d\", "
      "1);",
      "#include <stdio.h>\nstatic int order(const void* a, const void* b) { return *(const int*)a - *(const "
      "int*)b; }");
  for (std::size_t i = 0; i <= 6; ++i) EXPECT_EQ(r[i], 1) << i;
}

TEST(Kilolib, BuffersConnectCallbacksAndLoop) {
  Swarm swarm({"#include <kilolib.h>\n#include <message_buffered.h>\n#include <debug.h>\n"
               "static void setup(void) {}\n"
               "static void loop(void) { distance_measurement_t d; message_t* m;\n"
               "  while ((m = rxbuffer_peek(&d)) != 0) { set_color(m->data[0]); m->data[0]++; txbuffer_push(m); "
               "rxbuffer_pop(); }\n"
               "  printf(\"%d\", 1); }\n"
               "int main(void) { kilo_init(); debug_init(); kilo_message_buffered(); kilo_start(setup, loop); "
               "return 0; }\n"},
              1);
  swarm.start();
  Air air;
  air.receptions = {{0, message(7, 20)}, {0, message(7, 21)}};
  swarm.step(air);
  EXPECT_EQ(swarm.led(0), 21);
  EXPECT_EQ(asked(swarm), message(7, 21));
  Air left;
  left.sent = left.ask = {0};
  swarm.step(left);
  EXPECT_EQ(swarm.frame().offer_message.at(0), message(7, 22));
}

TEST(Kilolib, ACallbackThatWaitsLosesTheMessagesOfThatTime) {
  // One message per tick at a random time t of it. A callback of 30 ms blocks until t + 30 ms, and a packet takes 4.37 ms. So the
  // next message is heard if it comes at least 1.6 ms later in its tick, the one after that always: a part of 0.64 is heard.
  Swarm swarm({program("static uint8_t heard; static void rx(message_t* m, distance_measurement_t* d) { "
                       "set_motors(++heard, 0); delay(30); }\nstatic void loop(void) {}")},
              1);
  swarm.start();
  constexpr int kMessages = 250;
  int heard = 0, last = swarm.frame().motor_left[0];
  for (int n = 0; n < kMessages; ++n) {
    Air air;
    air.receptions = {{0, message(0)}};
    swarm.step(air);
    heard += (swarm.frame().motor_left[0] - last) & 255;
    last = swarm.frame().motor_left[0];
  }
  EXPECT_NEAR(heard / double{kMessages}, 0.64, 0.07);
}

TEST(Kilolib, AShortCallbackLosesNoMessage) {
  Swarm swarm({program("static uint8_t heard; static void rx(message_t* m, distance_measurement_t* d) { "
                       "set_motors(++heard, 0); }\nstatic void loop(void) {}")},
              1);
  swarm.start();
  Air air;
  air.receptions = {{0, message(0)}, {0, message(1)}, {0, message(2)}};
  for (int n = 0; n < 20; ++n) swarm.step(air);
  EXPECT_EQ(swarm.frame().motor_left[0], 60);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

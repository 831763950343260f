// ADC readings: sensors while a message arrives, and the voltage that replaces a message's strength.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// Robot 0's message if the radio requests one in this tick.
IrMessage sent_message(Swarm& swarm, Air air = {}) {
  air.ask = {0};
  swarm.step(air);
  const IrMessage said = swarm.frame().offer_message.at(0);
  Air sent;
  sent.sent = {0};
  swarm.step(sent);
  return said;
}

TEST(Readings, AVoltageReplacesTheNextMessagesStrength) {
  // The firmware leaves the ADC on the battery's channel; every other reading restores it.
  const auto high_after = [](const char* reading) {
    Swarm swarm({program(std::string("static message_t m; static int16_t got;\nstatic void rx(message_t* r, "
                                     "distance_measurement_t* d) {\n"
                                     "  if (r->data[0] == 1) ") +
                         reading +
                         "\n  else { m.data[0] = d->high_gain & 255; m.data[1] = d->high_gain >> 8; m.data[2] = "
                         "d->low_gain & 255;\n"
                         "    m.data[3] = d->low_gain >> 8; }\n}\nstatic message_t* tx(void) { m.data[4] = got & "
                         "255; m.data[5] = got >> 8; return &m; }\n")},
                1);
    swarm.start();
    Air air;
    air.receptions = {{0, message(0, 1)}};
    swarm.step(air);
    Air next;
    next.receptions = {{0, message(0, 2)}};
    const IrMessage first = sent_message(swarm, next), second = sent_message(swarm, next);
    const auto word = [](const IrMessage& m, std::size_t i) { return m[i] | m[i + 1] << 8; };
    EXPECT_EQ(word(first, 2), 300);
    EXPECT_EQ(word(second, 0), 400) << "the one after is right again";
    return std::pair{word(first, 0), word(first, 4)};
  };
  const auto [high, voltage] = high_after("got = get_voltage();");
  EXPECT_EQ(high, voltage);
  EXPECT_NEAR(voltage, 700, 5);
  EXPECT_EQ(high_after("{ got = get_voltage(); get_temperature(); }").first, 400);
  EXPECT_EQ(high_after("{ got = get_voltage(); get_ambientlight(); }").first, 400);
  EXPECT_EQ(high_after("{ got = get_voltage(); rand_hard(); }").first, 400);
}

TEST(Readings, FailForAsLongAsAMessageIsReceived) {
  // One message of 4.371 ms per tick of 32.768 ms; loop() begins anywhere relative to it.
  Swarm swarm({program("static uint16_t busy, n; static message_t m;\n"
                       "static message_t* tx(void) { m.data[0] = busy & 255; m.data[1] = busy >> 8; m.data[2] = n "
                       "& 255; m.data[3] = n >> 8;\n"
                       "  return &m; }\n"
                       "static void loop(void) { ++n; busy += get_ambientlight() == -1; }\n")},
              1);
  swarm.start();
  constexpr int kTicks = 20000;
  Air air;
  air.receptions = {{0, message(0)}};
  for (int i = 0; i < kTicks; ++i) swarm.step(air);
  const IrMessage m = sent_message(swarm);
  const double n = m[2] | m[3] << 8, busy = m[0] | m[1] << 8, p = 34970.0 / 262144;
  EXPECT_GE(n, kTicks);
  EXPECT_NEAR(busy / n, p, 4 * std::sqrt(p * (1 - p) / n))
      << "4 standard deviations: wrongly fails once in 16000 seeds";
}

TEST(Readings, ComeOnceTheMessageIsOver) {
  // A wait for a reading ends with the message.
  Swarm swarm(
      {program("static uint8_t n; static void loop(void) { while (get_ambientlight() < 0); set_motors(++n, 0); }")},
      1);
  swarm.start();
  Air air;
  air.receptions = {{0, message(0)}, {0, message(0)}, {0, message(0)}};
  for (std::uint8_t k = 2; k < 100; ++k) {
    swarm.step(air);
    EXPECT_GE(swarm.frame().motor_left[0], k - k / 8 - 3);
  }
}

TEST(Readings, FailDuringMessagesIfLoopRunsAsOnTheRobot) {
  // Three messages take 40 % of each tick; the rest is left for readings.
  const auto succeeded = [](int messages) {
    Swarm swarm({program("static uint32_t n; static message_t m;\n"
                         "static message_t* tx(void) { memcpy(m.data, &n, 4); return &m; }\n"
                         "static void loop(void) { if (get_ambientlight() >= 0) ++n; }")},
                1, 1, "", [](proto::Manifest& manifest) {
                  manifest.mutable_experiment()->mutable_robots(0)->set_loop_rate(proto::RobotGroup::AS_ON_ROBOT);
                });
    swarm.start();
    Air air;
    for (int i = 0; i < messages; ++i) air.receptions.push_back({0, message(0)});
    for (int k = 0; k < 50; ++k) swarm.step(air);
    const IrMessage m = sent_message(swarm, air);
    return static_cast<double>(m[0] | m[1] << 8 | m[2] << 16);
  };
  EXPECT_NEAR(succeeded(3) / succeeded(0), 1 - 3 * 34970.0 / 262144, 0.02);
}

TEST(Readings, SucceedInCallbacks) {
  Swarm swarm({program("static void rx(message_t* m, distance_measurement_t* d) { set_color(get_ambientlight() < 0 "
                       "? 1 : 2); }")},
              1);
  swarm.start();
  Air air;
  for (int i = 0; i < 7; ++i) air.receptions.push_back({0, message(0)});
  for (int k = 0; k < 50; ++k) {
    swarm.step(air);
    EXPECT_EQ(swarm.led(0), 2);
  }
}

TEST(Readings, HardRandomOctetsAreUniform) {
  Swarm swarm(
      {program("static uint32_t ones[8]; static message_t m; static uint8_t bit;\n"
               "static message_t* tx(void) { memcpy(m.data + 1, &ones[bit], 4); m.data[0] = bit++; return &m; }\n"
               "static void setup(void) { for (int i = 0; i < 20000; ++i) { uint8_t r = rand_hard();\n"
               "  for (int b = 0; b < 8; ++b) ones[b] += r >> b & 1; } }\n")},
      1);
  swarm.start();
  swarm.steps(3000);  // rand_hard() takes many cycles
  for (int b = 0; b < 8; ++b) {
    const IrMessage m = sent_message(swarm);
    ASSERT_EQ(m[0], b);
    EXPECT_NEAR(m[1] | m[2] << 8 | m[3] << 16, 10000, 4.5 * std::sqrt(5000.0)) << b;
  }
}

}  // namespace
}  // namespace kilotwin::behaviours::test

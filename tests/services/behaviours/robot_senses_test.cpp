// Light, battery and temperature as programs read them.
#include <gtest/gtest.h>

#include <cmath>

#include "idl/checkpoint.pb.h"
#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// A program that reports 4 octets of `value` (an int32_t) through messages.
std::string reporting(const std::string& text) {
  return program(
      "static int32_t value; static message_t m; static message_t* tx(void) { memcpy(m.data, &value, 4); return "
      "&m; }\n" +
      text);
}

std::int32_t value_of(const IrMessage& m) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(m[0]) | static_cast<std::uint32_t>(m[1]) << 8 |
                                   static_cast<std::uint32_t>(m[2]) << 16 | static_cast<std::uint32_t>(m[3]) << 24);
}

/// The values that each robot reports now.
std::vector<std::int32_t> values(Swarm& swarm) {
  Air ask;
  for (std::uint32_t robot = 0; robot < swarm.plan->robots(); ++robot) ask.ask.push_back(robot);
  swarm.step(ask);
  std::vector<std::int32_t> result;
  for (const IrMessage& m : swarm.frame().offer_message) result.push_back(value_of(m));
  Air sent;
  sent.sent = ask.ask;
  swarm.step(sent);
  return result;
}

TEST(RobotSenses, ReadTheLightWhereTheRobotIs) {
  // Robots stand 40 mm apart along x, looking along it: a lamp high above the third.
  Swarm swarm(
      {reporting("static void loop(void) { value = get_ambientlight(); }")}, 6, 2,
      "light { ambient: 100 source { x_mm: 80 height_mm: 130 intensity: 5 } sensor { cosine: false gain_sd: 0 "
      "noise_floor: 0 noise_relative: 0 } }");
  swarm.start();
  const auto read = values(swarm);
  for (int i = 0; i < 6; ++i) {
    const double x = 40 * i + 14.5 * std::cos(100 * kPi / 180) - 80, y = 14.5 * std::sin(100 * kPi / 180);
    EXPECT_EQ(read[static_cast<std::size_t>(i)], std::lround(100 + 5e6 / (x * x + y * y + 100 * 100))) << i;
  }
}

TEST(RobotSenses, ReadingsAreNormalWithTheStatedSpreadAndEndAt1023) {
  Swarm swarm({reporting("static int32_t mean; static int32_t n; static void loop(void) {\n"
                         "  for (int i = 0; i < 100 && n < 20000; ++i, ++n) { int32_t d = get_ambientlight() - "
                         "400; mean += d; value += d * d; }\n"
                         "  if (n == 20000) { n = 20001; value = (value / 200) * 1000 + 500 + mean / 200; } }")},
              1, 1, "light { ambient: 400 sensor { gain_sd: 0 noise_floor: 0 noise_relative: 0.05 } }");
  swarm.start();
  swarm.steps(250);
  const std::int32_t reported = values(swarm)[0];
  EXPECT_NEAR(reported / 1000 / 100.0, 20 * 20 + 1 / 12.0, 4 * 400 * std::sqrt(2.0 / 20000))
      << "variance, rounding included";
  EXPECT_NEAR(reported % 1000 - 500, 0, 4 * 100 * 20 / std::sqrt(20000.0)) << "mean, hundredths";
  Swarm bright({reporting("static void loop(void) { value = get_ambientlight(); }")}, 1, 1,
               "light { source { height_mm: 31 } sensor { cosine: false } }");
  bright.start();
  EXPECT_EQ(values(bright)[0], 1023);
}

TEST(RobotSenses, ReadTheTemperature) {
  const std::string text = reporting("static void loop(void) { value = get_temperature(); }");
  Swarm plain({text}, 1);
  plain.start();
  EXPECT_EQ(values(plain)[0], 292);
  for (const auto& [celsius, mV] : std::vector<std::pair<int, int>>{{25, 314}, {85, 380}, {-40, 247}}) {
    Swarm swarm({text}, 1, 1,
                "temperature { celsius: " + std::to_string(celsius) + " offset_sd: 0 reading_sd: 0 }");
    swarm.start();
    EXPECT_NEAR(values(swarm)[0], mV / 1100.0 * 1024, 1) << celsius;
  }
}

TEST(RobotSenses, BatteriesLoseTheChargeThatLoadsDraw) {
  // Motors, LED and messages of a program whose load is known in each tick.
  Swarm swarm(
      {program("static message_t m; static message_t* tx(void) { return &m; }\n"
               "static void loop(void) { set_motors(kilo_ticks, 3 * kilo_ticks); set_color(kilo_ticks); }")},
      3, 1, "battery { capacity_mAh: 10 }");
  const senses::Battery battery(*swarm.plan);
  swarm.start();
  std::vector<std::int64_t> charge;
  proto::BehavioursState state;
  const auto charges = [&] {
    swarm.hosts[0]->save(state);
    std::vector<std::int64_t> result;
    for (const auto& robot : state.robot()) result.push_back(robot.charge());
    return result;
  };
  charge = charges();
  for (int k = 0; k < 300; ++k) {
    Air air = echo(swarm.frame());
    swarm.step(air);
    const ActuationFrame frame = swarm.frame();
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      const bool sent = std::find(air.sent.begin(), air.sent.end(), robot) != air.sent.end();
      charge[robot] -=
          battery.drain({frame.motor_left[robot], frame.motor_right[robot], frame.led[robot], false, sent});
    }
    ASSERT_EQ(charges(), charge) << k;
  }
}

TEST(RobotSenses, AFlatRobotIsOffAndRestartsOnceItIsCharged) {
  // Two robots, one of them on a charger that gives less than its motors take and more than it needs when off.
  Swarm swarm(
      {program("static uint8_t setups; static void setup(void) { ++setups; }\n"
               "static void loop(void) { set_motors(255, 255); set_color(setups); }")},
      2, 1,
      "battery { capacity_mAh: 0.01 idle_mA: 1 motor_mA: 50 charger { x_mm: 40 radius_mm: 5 current_mA: 20 } }");
  swarm.start();
  int off = 0;
  while (swarm.life_cycle(0) != LifeCycle::kFlat && off++ < 200) swarm.step();
  // 0.01 mAh at 101 mA: 0.356 s.
  EXPECT_NEAR(off * 0.032768, 0.01 / 105 * 3600, 0.1);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  EXPECT_EQ(swarm.led(0), 0);
  const std::uint64_t hash = swarm.hash();
  int until_flat = 0, until_idle = 0;
  while (swarm.life_cycle(1) != LifeCycle::kFlat && until_flat++ < 200) swarm.step();
  while (swarm.life_cycle(1) == LifeCycle::kFlat && until_idle++ < 200) swarm.step();
  EXPECT_NEAR(until_idle * 0.032768, 0.05 * 0.01 / 20 * 3600, 0.04) << "5 % at 20 mA";
  EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kIdle);
  EXPECT_NE(swarm.hash(), hash);
  swarm.steps(30);
  swarm.step(to_all(swarm, message(kRun)));
  EXPECT_EQ(swarm.led(1), 1) << "its memory was lost";
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kFlat);
}

TEST(RobotSenses, TheBatteryStateShowsTheFirmwaresColours) {
  // The curve passes 4.0 V at 80 % and 3.6 V at 10 %.
  for (const auto& [charge, led] :
       std::vector<std::pair<const char*, int>>{{"0.9", 0x0C}, {"0.6", 0x30}, {"0.15", 0x0F}, {"0.05", 0x03}}) {
    Swarm swarm({program("")}, 1, 1,
                std::string("battery { resistance_ohm: 0 reading_sd: 0 charge: ") + charge + " }");
    swarm.start();
    swarm.step(to_all(swarm, message(kVoltage)));
    EXPECT_EQ(swarm.led(0), led) << charge;
  }
}

TEST(RobotSenses, ABatteryWithoutNoiseGivesNoRandomness) {
  Swarm swarm({reporting("static void setup(void) { for (int i = 0; i < 100; ++i) value += rand_hard() == 255 ? 1 "
                         ": rand_hard() == 0 ? 100 : 10000; }")},
              1, 1, "battery { reading_sd: 0 }");
  swarm.start();
  swarm.steps(5);
  const std::int32_t reported = values(swarm)[0];
  EXPECT_TRUE(reported == 100 || reported == 10000) << reported;
}

TEST(RobotSenses, GoThroughCheckpoints) {
  const std::string text = reporting(
      "static void loop(void) { value = value * 31 + get_ambientlight() + get_voltage() * 7 + rand_hard();\n"
      "  set_motors(value, value >> 8); }");
  const std::string experiment =
      "battery { capacity_mAh: 0.05 charge_sd: 0.3 charge: 0.5 charger { x_mm: 100 radius_mm: 50 } }"
      "light { shadows: true source { x_mm: 200 y_mm: 10 height_mm: 40 circle { period_s: 3 } } }"
      "temperature {}";
  Swarm first({text}, 12, 3, experiment), second({text}, 12, 2, experiment);
  first.start();
  first.steps(40);
  std::vector<proto::BehavioursState> parts(3);
  std::vector<const proto::BehavioursState*> pointers;
  for (std::size_t h = 0; h < 3; ++h) {
    first.hosts[h]->save(parts[h]);
    pointers.push_back(&parts[h]);
  }
  for (const auto& host : second.hosts) host->load(first.tick, pointers);
  second.tick = first.tick;
  for (int k = 0; k < 60; ++k) {
    ASSERT_TRUE(equal(first.frame(), second.frame())) << k;
    ASSERT_EQ(first.hash(), second.hash());
    first.step();
    second.step();
  }
  EXPECT_EQ(first.life_cycle(0), LifeCycle::kFlat) << "or the test is about nothing";
}

TEST(RobotSenses, EepromsOfTheExperimentAreUsed) {
  Swarm swarm(
      {reporting(
          "#include <avr/eeprom.h>\nstatic void loop(void) { value = kilo_uid | kilo_straight_left << 16; }")},
      4, 2, "", [](proto::Manifest& manifest) {
        manifest.mutable_experiment()->mutable_robots(0)->set_first_uid(1000);
        proto::RobotEeprom& eeprom = *manifest.add_eeprom();
        std::string content(1024, '\xff');
        content[0xB0] = 5;
        content[0xB1] = 1;
        content[0x0C] = 99;
        eeprom.set_robot(2);
        eeprom.set_content(content);
      });
  swarm.start();
  const auto reported = values(swarm);
  EXPECT_EQ(reported[0] & 0xffff, 1000);
  EXPECT_EQ(reported[3] & 0xffff, 1003);
  EXPECT_EQ(reported[3] >> 16, 70);
  EXPECT_EQ(reported[2] & 0xffff, 261);
  EXPECT_EQ(reported[2] >> 16, 99);
}

}  // namespace
}  // namespace kilotwin::behaviours::test

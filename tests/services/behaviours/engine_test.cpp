#include "services/behaviours/engine.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "core/base/error.hpp"
#include "idl/manifest.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

TEST(Engine, RobotsAreIdleUntilRun) {
  Swarm swarm({program("static void setup(void) { set_color(1); set_motors(10, 20); }\nstatic void loop(void) { "
                       "set_color(2); }")},
              3);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  swarm.steps(3);
  EXPECT_EQ(swarm.life_cycle(2), LifeCycle::kIdle);
  EXPECT_EQ(swarm.frame().motor_left[2], 0);
  swarm.step(to_all(swarm, message(kRun)));
  EXPECT_EQ(swarm.life_cycle(2), LifeCycle::kRunning);
  EXPECT_EQ(swarm.led(2), 2);
  EXPECT_EQ(swarm.frame().motor_left[1], 10);
  EXPECT_EQ(swarm.frame().motor_right[1], 20);
  EXPECT_EQ(swarm.frame().tx_period[1], 3906);
}

TEST(Engine, LoopRunsOncePerTickOnTheRobotsClock) {
  Swarm swarm({program("static uint8_t n; static void loop(void) { ++n; if (n == kilo_ticks) set_color(n); }")}, 1);
  swarm.start();
  for (std::uint8_t k = 2; k < 20; ++k) {
    swarm.step();
    EXPECT_EQ(swarm.led(0), k);
  }
}

TEST(Engine, GlobalsAndStaticsArePrivate) {
  Swarm swarm({program("uint8_t global = 1; static uint8_t own;\n"
                       "static void setup(void) { own = kilo_uid; }\n"
                       "static void loop(void) { static uint8_t calls = 3; global += own; ++calls;\n"
                       "  set_motors(global, calls); }")},
              40);
  swarm.start();
  swarm.steps(4);
  const ActuationFrame frame = swarm.frame();
  for (std::uint32_t robot = 0; robot < 40; ++robot) {
    EXPECT_EQ(frame.motor_left[robot], (1 + 5 * robot) % 256);
    EXPECT_EQ(frame.motor_right[robot], 8);
  }
}

TEST(Engine, SeveralProgramsRunSideBySide) {
  Swarm swarm(
      {program("static void loop(void) { set_color(1); }"), program("static void loop(void) { set_color(2); }")},
      9);
  swarm.start();
  EXPECT_EQ(swarm.led(8), 1);
  EXPECT_EQ(swarm.led(9), 2);
}

TEST(Engine, DelayTakesItsTimeWhileMessagesArrive) {
  // 100 ms = 800000 cycles = 3.05 ticks. A wait is over in the tick into which its end falls; the rest adds up.
  Swarm swarm({program("static uint8_t heard, rounds;\n"
                       "static void rx(message_t* m, distance_measurement_t* d) { set_motors(++heard, 0); }\n"
                       "static message_t m; static message_t* tx(void) { m.data[0] = kilo_ticks; return &m; }\n"
                       "static void loop(void) { delay(100); set_color(++rounds); }")},
              1);
  swarm.start();
  for (int k = 1; k <= 610; ++k) {
    Air air = to_all(swarm, message(0));
    if (k == 2) air.ask = {0};
    swarm.step(air);
    const ActuationFrame frame = swarm.frame();
    EXPECT_EQ(frame.motor_left[0], k % 256);
    EXPECT_EQ(frame.led[0], ((k + 1) * 262144 - 1) / 800000 % 64) << k;
    if (k == 2) {
      EXPECT_EQ(frame.offer_message.at(0)[0], 3);  // kilo_ticks went on as well
    }
  }
}

TEST(Engine, ShortDelaysAddUp) {
  // Two waits of 20 ms: loop() takes 40 ms.
  Swarm swarm({program("#include <util/delay.h>\nstatic uint8_t n;\n"
                       "static void loop(void) { delay(20); _delay_ms(20.0); set_motors(++n, 0); }")},
              1);
  swarm.start();
  swarm.steps(100);
  EXPECT_NEAR(swarm.frame().motor_left[0], 100 * 32.768 / 40, 1);
}

TEST(Engine, WaitingForTheClockLetsTimePass) {
  Swarm swarm(
      {program(
          "static uint8_t n;\n"
          "static void loop(void) { uint32_t t = kilo_ticks + 4; while (kilo_ticks < t) {} set_motors(++n, 0); }")},
      1);
  swarm.start();
  swarm.steps(40);
  EXPECT_NEAR(swarm.frame().motor_left[0], 10, 1);
}

TEST(Engine, CallbacksComeInOrder) {
  // Each call appends a digit: success 1, reception 2 or 3, loop 4, transmission 5.
  Swarm swarm({program("static message_t m; static uint8_t n;\n"
                       "static void note(uint8_t what) { if (n < 9) m.data[n++] = what; }\n"
                       "static void tx_success(void) { n = 0; note(1); }\n"
                       "static void rx(message_t* r, distance_measurement_t* d) { note(r->data[0]); }\n"
                       "static void loop(void) { note(4); }\n"
                       "static message_t* tx(void) { note(5); return &m; }\n")},
              1);
  swarm.start();
  Air first;
  first.ask = {0};
  swarm.step(first);
  ASSERT_EQ(swarm.frame().offer_robot.size(), 1u);
  Air second;
  second.ask = second.sent = {0};
  second.receptions = {{0, message(0, 2)}, {0, message(0, 3)}};
  swarm.step(second);
  const IrMessage expected{1, 2, 3, 4, 5};
  IrMessage seen = swarm.frame().offer_message.at(0);
  std::fill(seen.begin() + 5, seen.end(), std::uint8_t{0});
  EXPECT_EQ(seen, expected);
}

TEST(Engine, AMessageIsHeldUntilItIsSent) {
  Swarm swarm({program("static message_t m; static message_t* tx(void) { m.data[0]++; return &m; }")}, 2);
  Air ask;
  ask.ask = {0};
  swarm.step(ask);
  EXPECT_TRUE(swarm.frame().offer_robot.empty());  // not running
  swarm.start();
  swarm.step(ask);
  EXPECT_EQ(swarm.frame().offer_message.at(0)[0], 1);
  const std::uint64_t holding = swarm.hash();
  swarm.step(ask);
  EXPECT_TRUE(swarm.frame().offer_robot.empty());
  EXPECT_EQ(swarm.hash(), holding);
  Air sent;
  sent.sent = {0};
  swarm.step(sent);
  EXPECT_NE(swarm.hash(), holding);
  swarm.step(ask);
  EXPECT_EQ(swarm.frame().offer_message.at(0)[0], 2);
}

TEST(Engine, MessagesOfTheOverheadController) {
  Swarm swarm({program("static uint8_t setups, loops, heard;\n"
                       "static void rx(message_t* m, distance_measurement_t* d) { set_color(++heard); }\n"
                       "static void setup(void) { ++setups; }\n"
                       "static void loop(void) { set_motors(setups, ++loops); }")},
              1);
  swarm.step();
  swarm.step(to_all(swarm, message(5)));  // users' messages are heard in any state
  EXPECT_EQ(swarm.led(0), 1);
  swarm.step(to_all(swarm, message(kRun)));
  swarm.step(to_all(swarm, message(kRun)));
  EXPECT_EQ(swarm.frame().motor_left[0], 1);
  EXPECT_EQ(swarm.frame().motor_right[0], 2);
  swarm.step(to_all(swarm, message(kWakeup)));  // pause
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.frame().motor_right[0], 0);
  swarm.steps(5);
  swarm.step(to_all(swarm, message(kRun)));  // resume: no second setup
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kRunning);
  EXPECT_EQ(swarm.frame().motor_left[0], 1);
  EXPECT_EQ(swarm.frame().motor_right[0], 3);
  swarm.step(to_all(swarm, message(kReset)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  swarm.step(to_all(swarm, message(kRun)));
  EXPECT_EQ(swarm.frame().motor_left[0], 1);
  EXPECT_EQ(swarm.frame().motor_right[0], 1);
  swarm.step(to_all(swarm, message(kVoltage)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kBattery);
  EXPECT_EQ(swarm.led(0), 0x0C);
}

TEST(Engine, ASleepingRobotListensEveryEightSeconds) {
  Swarm swarm({program("")}, 1);
  swarm.start();
  swarm.step(to_all(swarm, message(kSleep)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kSleeping);
  // The radio delivers a tick's messages to robots that were not asleep at the tick's start.
  int until_it_listens = 0;
  while (swarm.life_cycle(0) == LifeCycle::kSleeping && until_it_listens < 400) {
    swarm.step(to_all(swarm, message(kWakeup)));  // in vain
    ++until_it_listens;
  }
  EXPECT_NEAR(until_it_listens * 0.032768, 8, 0.1);
  EXPECT_EQ(swarm.led(0), 63);
  swarm.steps(2);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kSleeping);  // nothing was heard
  while (swarm.life_cycle(0) == LifeCycle::kSleeping) swarm.step();
  swarm.step();
  swarm.step(to_all(swarm, message(kWakeup)));
  swarm.steps(300);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.led(0), 0);
}

TEST(Engine, ReadUidTurnsWhereTheBitIsSet) {
  Swarm swarm({program("")}, 2);
  swarm.steps(2);
  swarm.step(to_all(swarm, message(kReadUid, 0)));
  EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kMoving);
  swarm.steps(2);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  EXPECT_EQ(swarm.frame().motor_left[1], 60);
  EXPECT_EQ(swarm.frame().motor_right[1], 0);
}

TEST(Engine, TheClockMayStandOrRunTwice) {
  Swarm swarm({program("static void loop(void) { set_motors(kilo_ticks, 0); }")}, 1);
  swarm.start();
  Air air;
  air.kilo_ticks = 0;
  swarm.step(air);
  EXPECT_EQ(swarm.frame().motor_left[0], 1);
  air.kilo_ticks = 2;
  swarm.step(air);
  EXPECT_EQ(swarm.frame().motor_left[0], 3);
}

TEST(Engine, HostsOnThreadsEqualOneHost) {
  const std::string disperse = std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c";
  Swarm one({disperse}, 100), two({disperse}, 100, 2);
  for (int k = 0; k < 300; ++k) {
    Air air = echo(one.frame());
    if (k < 3) air = to_all(one, message(kRun));
    one.step(air);
    std::thread other([&] { two.hosts[1]->step(two.tick, air.frame(two.tick, two.plan->share(HostId{1}))); });
    two.hosts[0]->step(two.tick, air.frame(two.tick, two.plan->share(HostId{0})));
    other.join();
    ++two.tick;
    ASSERT_TRUE(equal(one.frame(), two.frame())) << "tick " << k;
    ASSERT_EQ(one.hash(), two.hash());
  }
}

/// Ticks end anywhere in these calls. The host's duties of a tick are not part of a robot's memory.
TEST(Engine, ManyChangesOfMotorsInATickDoNotDependOnTheHosts) {
  const std::string source = program(
      "static void loop(void) { set_motors(70 + (rand_soft() & 1), kilo_uid);\n"
      "  set_motors(kilo_uid & 7, 70); }");
  const auto as_on_robot = [](proto::Manifest& manifest) {
    manifest.mutable_experiment()->mutable_robots(0)->set_loop_rate(proto::RobotGroup::AS_ON_ROBOT);
  };
  Swarm one({source}, 60, 1, "", as_on_robot), several({source}, 60, 12, "", as_on_robot);
  one.start();
  several.start();
  for (int k = 0; k < 300; ++k) {
    one.step();
    several.step();
    ASSERT_TRUE(equal(one.frame(), several.frame())) << "tick " << k;
    ASSERT_EQ(one.hash(), several.hash()) << "tick " << k;
  }
}

TEST(ProgramSet, RejectsAFileWhoseHashDiffersFromItsName) {
  Swarm swarm({program("")}, 1);
  const std::string name = "programs/" + swarm.plan->programs()[0].file();
  Folder other;
  EXPECT_THROW((void)ProgramSet::load(*swarm.plan, other.path()), UserError);
  other.write(name, "something else");
  EXPECT_THROW((void)ProgramSet::load(*swarm.plan, other.path()), UserError);
  EXPECT_EQ(ProgramSet::load(*swarm.plan, swarm.folder.path())->size(), 1u);  // shared with the first
}

}  // namespace
}  // namespace kilotwin::behaviours::test

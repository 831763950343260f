// The firmware's reaction to messages in each of its states, and the memory that survives a reset.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "idl/checkpoint.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

constexpr std::uint8_t kBoot = 0x80, kBootPage = 0x81, kBootSize = 0x82, kCharge = 0x86, kCalib = 0x8A,
                       kUnknown = 0x8B, kUser = 5;
constexpr std::uint8_t kSave = 0, kUid = 1, kTurnLeft = 2, kTurnRight = 3, kStraight = 4;

Air heard(const IrMessage& what) {
  Air air;
  air.receptions = {{0, what}};
  return air;
}

/// A CALIB message, as kilolib packs it.
IrMessage calib(std::uint8_t mode, std::uint16_t uid = 0, std::uint8_t turn_left = 0, std::uint8_t turn_right = 0,
                std::uint8_t straight_left = 0, std::uint8_t straight_right = 0) {
  IrMessage m = message(kCalib, mode);
  m[1] = static_cast<std::uint8_t>(uid & 0xff);
  m[2] = static_cast<std::uint8_t>(uid >> 8);
  m[3] = turn_left;
  m[4] = turn_right;
  m[5] = straight_left;
  m[6] = straight_right;
  return m;
}

/// Sends the number of received messages in data[0] and of setups in data[1]. Drives with duties 10, 20 while it runs.
const char* const kProbe =
    "static uint8_t got, setups; static message_t m;\n"
    "static void rx(message_t* r, distance_measurement_t* d) { ++got; set_color(RGB(1, 2, 3)); }\n"
    "static message_t* tx(void) { m.data[0] = got; m.data[1] = setups; return &m; }\n"
    "static void setup(void) { ++setups; }\n"
    "static void loop(void) { set_motors(10, 20); set_color(RGB(1, 0, 1)); }\n";

constexpr LifeCycle kStates[] = {LifeCycle::kSleeping, LifeCycle::kIdle,     LifeCycle::kBattery,
                                 LifeCycle::kRunning,  LifeCycle::kCharging, LifeCycle::kMoving};

void listen(Swarm& swarm) {
  for (int i = 0; i < 300 && swarm.life_cycle(0) == LifeCycle::kSleeping; ++i) swarm.step();
}

/// Brings robots that have run once into a state by messages alone; sleeping ones to where they listen.
void bring(Swarm& swarm, LifeCycle state) {
  swarm.start();
  const auto tell = [&](const IrMessage& what) { swarm.step(to_all(swarm, what)); };
  switch (state) {
    case LifeCycle::kSleeping:
      tell(message(kSleep));
      ASSERT_EQ(swarm.life_cycle(0), LifeCycle::kSleeping);
      EXPECT_EQ(swarm.led(0), 0);
      return listen(swarm);
    case LifeCycle::kIdle: return tell(message(kWakeup));
    case LifeCycle::kBattery: return tell(message(kVoltage));
    case LifeCycle::kCharging: return tell(message(kCharge));
    case LifeCycle::kMoving: return tell(calib(kStraight, 0, 0, 0, 80, 90));
    default: return;
  }
}

struct Then {
  LifeCycle state;
  std::uint8_t left = 0, right = 0;  ///< motors
};

/// The firmware's process_message() as a table; `from` is the state in which the message is heard.
Then expected(LifeCycle from, const IrMessage& heard_message) {
  const bool runs = from == LifeCycle::kRunning, moves = from == LifeCycle::kMoving;
  switch (heard_message[9]) {
    case kBoot:
    case kReset:
    case kWakeup: return {LifeCycle::kIdle};
    case kSleep: return {LifeCycle::kSleeping};
    case kCharge: return {LifeCycle::kCharging};
    case kVoltage: return {LifeCycle::kBattery};
    case kRun: return {LifeCycle::kRunning, 10, 20};
    case kReadUid: return {LifeCycle::kMoving};  // a bit that is 0
    case kCalib:
      switch (heard_message[0]) {
        case kSave: return runs ? Then{from, 10, 20} : Then{moves ? LifeCycle::kIdle : from};
        case kTurnLeft: return {LifeCycle::kMoving, 71, 0};
        case kTurnRight: return {LifeCycle::kMoving, 0, 72};
        // The same speeds again: a moving robot continues, and from another state the motors do not start.
        case kStraight: return {LifeCycle::kMoving, 80, 90};
        case kUid: return {LifeCycle::kMoving};
        default: return moves ? Then{from, 80, 90} : Then{LifeCycle::kMoving};  // no mode: no new motion
      }
    case kUser: return runs ? Then{from, 10, 20} : moves ? Then{from, 80, 90} : Then{from};
    default: return {from};  // no state of its own, but motors are off
  }
}

class LifeCycles : public testing::TestWithParam<LifeCycle> {};

TEST_P(LifeCycles, FollowEveryMessageAsTheFirmwareDoes) {
  const LifeCycle from = GetParam();
  const IrMessage messages[] = {message(kUser),
                                message(kBoot),
                                message(kBootPage),
                                message(kBootSize),
                                message(kReset),
                                message(kSleep),
                                message(kWakeup),
                                message(kCharge),
                                message(kVoltage),
                                message(kRun),
                                message(kReadUid, 9),
                                message(kUnknown),
                                calib(kSave),
                                calib(kUid, 300),
                                calib(kTurnLeft, 0, 71),
                                calib(kTurnRight, 0, 0, 72),
                                message(0xff),
                                calib(77),
                                calib(kStraight, 0, 0, 0, 80, 90)};
  // Robot n hears message n.
  constexpr auto kRobots = static_cast<std::uint32_t>(std::size(messages));
  Swarm swarm({program(kProbe)}, kRobots);
  bring(swarm, from);
  // For the radio, a sleeping robot that listens is idle.
  EXPECT_EQ(swarm.life_cycle(0), from == LifeCycle::kSleeping ? LifeCycle::kIdle : from);
  Air air;
  for (std::uint32_t n = 0; n < kRobots; ++n) air.receptions.push_back({n, messages[n]});
  swarm.step(air);
  if (from == LifeCycle::kSleeping) swarm.steps(7);  // they end their time of listening first
  const ActuationFrame frame = swarm.frame();
  const auto trace = [&](std::uint32_t n) {
    return testing::Message() << "message " << int{messages[n][9]} << ", mode " << int{messages[n][0]};
  };
  for (std::uint32_t n = 0; n < kRobots; ++n) {
    SCOPED_TRACE(trace(n));
    const Then then = expected(from, messages[n]);
    EXPECT_EQ(LifeCycle{frame.life_cycle[n]}, then.state);
    EXPECT_EQ(frame.motor_left[n], then.left);
    EXPECT_EQ(frame.motor_right[n], then.right);
  }
  // A robot can report its counters only while it runs, and a sleeping robot must listen first.
  swarm.steps(from == LifeCycle::kSleeping ? 250 : 245);
  for (int repeat = 0; repeat < 2; ++repeat) swarm.step(to_all(swarm, message(kRun)));
  swarm.steps(7);
  Air ask;
  for (std::uint32_t n = 0; n < kRobots; ++n) ask.ask.push_back(n);
  swarm.step(ask);
  const ActuationFrame reported = swarm.frame();
  for (std::uint32_t at = 0; at < reported.offer_robot.size(); ++at) {
    const std::uint32_t n = reported.offer_robot[at];
    SCOPED_TRACE(trace(n));
    const bool anew = messages[n][9] == kReset || messages[n][9] == kBoot;
    EXPECT_EQ(reported.offer_message[at][0], messages[n][9] < 0x80 ? 1 : 0);
    EXPECT_EQ(reported.offer_message[at][1], 1) << (anew ? "started anew" : "resumed, not started again");
  }
  EXPECT_GE(reported.offer_robot.size(), from == LifeCycle::kSleeping ? 12u : kRobots - 1);
}

std::string name_of(const testing::TestParamInfo<LifeCycle>& tested) {
  constexpr const char* kNames[] = {"sleeping", "idle", "battery", "setup", "running", "charging", "moving"};
  return kNames[static_cast<std::size_t>(tested.param)];
}

INSTANTIATE_TEST_SUITE_P(States, LifeCycles, testing::ValuesIn(kStates), name_of);

TEST(LifeCycle, RunFromAnotherStateRestoresMotorsThatAMessageSwitchedOff) {
  Swarm swarm({program(kProbe)}, 1);
  swarm.start();
  swarm.step(heard(message(kUnknown)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kRunning);
  swarm.step(heard(message(kRun)));  // it runs already
  swarm.steps(3);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  swarm.step(heard(message(kWakeup)));
  swarm.step(heard(message(kRun)));
  EXPECT_EQ(swarm.frame().motor_left[0], 10);
}

TEST(LifeCycle, MotorsStandStillAfterAResumeUntilTheProgramSetsThem) {
  Swarm swarm({program("static void setup(void) { set_motors(50, 60); }")}, 1);
  swarm.start();
  EXPECT_EQ(swarm.frame().motor_left[0], 50);
  swarm.step(heard(message(kWakeup)));
  swarm.step(heard(message(kRun)));
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
}

TEST(LifeCycle, RobotsSendWhileTheyRunAndInNoOtherState) {
  for (const LifeCycle state : kStates) {
    Swarm swarm({program(kProbe)}, 1);
    bring(swarm, state);
    Air ask;
    ask.ask = {0};
    swarm.step(ask);
    EXPECT_EQ(swarm.frame().offer_robot.size(), state == LifeCycle::kRunning ? 1u : 0u) << int(state);
  }
}

TEST(LifeCycle, AResetInitialisesGlobalsAndKeepsNoinitVariables) {
  Swarm swarm(
      {program(
          "#include <avr/eeprom.h>\n"
          "static uint8_t zero, seven = 7; uint8_t kept __attribute__((section(\".noinit\"))); uint8_t EEMEM "
          "stored = 3;\n"
          "static void rx(message_t* m, distance_measurement_t* d) { ++kept; }\n"
          "static void setup(void) { ++zero; ++seven; eeprom_write_byte(&stored, eeprom_read_byte(&stored) + 1);\n"
          "  eeprom_write_byte((uint8_t*)500, eeprom_read_byte((uint8_t*)500) + 1); }\n"
          "static message_t m; static message_t* tx(void) { m.data[0] = zero; m.data[1] = seven; m.data[2] = "
          "kept;\n"
          "  m.data[3] = eeprom_read_byte(&stored); m.data[4] = eeprom_read_byte((uint8_t*)500); m.data[5] = "
          "kilo_ticks;\n"
          "  m.data[6] = rand_soft(); return &m; }")},
      1);
  swarm.step();
  constexpr int shifted = 0xAA ^ (0xAA << 3 & 0xff), first_soft = shifted ^ shifted >> 5;
  for (std::uint8_t round = 1; round <= 3; ++round) {
    swarm.step(heard(message(kRun)));
    swarm.step(heard(message(kUser)));
    Air ask;
    ask.ask = {0};
    swarm.step(ask);
    const IrMessage got = swarm.frame().offer_message.at(0);
    EXPECT_EQ(got[0], 1);
    EXPECT_EQ(got[1], 8);
    EXPECT_EQ(got[2], 2 * round - 1) << "one more in the very tick of each reset";
    EXPECT_EQ(got[3], 3 + round);
    EXPECT_EQ(got[4], (0xff + round) & 0xff);
    EXPECT_EQ(got[5], 3) << "kilo_ticks begins anew";
    EXPECT_EQ(got[6], first_soft) << "and so do the generators";
    Air last = heard(message(kUser));
    last.receptions.push_back({0, message(kReset)});
    last.receptions.push_back({0, message(kRun)});  // lost while the robot starts
    swarm.step(last);
    EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
    EXPECT_EQ(swarm.frame().offer_robot.size(), 0u);
  }
}

TEST(LifeCycle, TheBootloaderEndsWithAnyOtherMessage) {
  Swarm swarm({program(kProbe)}, 1);
  swarm.start();
  swarm.step(heard(message(kBoot)));
  EXPECT_EQ(swarm.led(0), 0);
  swarm.step(heard(message(kBootPage)));
  swarm.step(heard(message(kBootSize)));
  swarm.steps(100);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  swarm.step(heard(message(kRun)));  // the program restarts
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  swarm.step(heard(message(kRun)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kRunning);
}

TEST(LifeCycle, ASleepingRobotThatHearsSomethingKeepsListening) {
  Swarm swarm({program("")}, 1);
  swarm.start();
  swarm.step(heard(message(kSleep)));
  listen(swarm);
  EXPECT_EQ(swarm.led(0), 63);
  swarm.step(heard(message(kUser)));
  swarm.step();
  EXPECT_EQ(swarm.led(0), 3) << "red";
  int listens = 0;
  for (; swarm.life_cycle(0) != LifeCycle::kSleeping; ++listens) swarm.step();
  EXPECT_NEAR(listens * 0.032768, 0.1, 0.034);
}

// EEPROM.

/// The 8 octets that a program reads from `address`.
std::array<std::uint8_t, 8> read(Swarm& swarm, std::uint32_t robot, std::uint16_t address) {
  Air air;
  IrMessage where = message(1);
  where[0] = static_cast<std::uint8_t>(address & 0xff);
  where[1] = static_cast<std::uint8_t>(address >> 8);
  air.receptions = {{robot, where}};
  air.ask = {robot};
  swarm.step(air);
  std::array<std::uint8_t, 8> octets{};
  const ActuationFrame frame = swarm.frame();
  EXPECT_EQ(frame.offer_robot, std::vector<std::uint32_t>{robot});
  std::copy_n(frame.offer_message.at(0).begin(), 8, octets.begin());
  Air sent;
  sent.sent = {robot};
  swarm.step(sent);
  return octets;
}

const char* const kReader =
    "#include <avr/eeprom.h>\nstatic message_t m;\n"
    "static void rx(message_t* r, distance_measurement_t* d) {\n"
    "  const uint8_t* at = (const uint8_t*)(uintptr_t)(r->data[0] | r->data[1] << 8);\n"
    "  if (r->type == 1) eeprom_read_block(m.data, at, 8);\n"
    "  if (r->type == 2) eeprom_write_byte((uint8_t*)at, r->data[2]);\n}\n"
    "static message_t* tx(void) { return &m; }\n";

TEST(Eeprom, IsLaidOutOctetByOctetAsKilolibReadsIt) {
  Swarm swarm({program(kReader)}, 300);
  swarm.start();
  std::array<std::uint8_t, 1024> expected{};
  expected.fill(0xff);
  expected[0x05] = expected[0x09] = 60;  // the scene's duty of turns
  expected[0x0C] = expected[0x14] = 70;
  const int low[] = KILOTWIN_IR_LOW, high[] = KILOTWIN_IR_HIGH;
  for (std::size_t i = 0; i < 14; ++i) {
    expected[0x20 + 2 * i] = static_cast<std::uint8_t>(low[i] / 256);
    expected[0x21 + 2 * i] = static_cast<std::uint8_t>(low[i] % 256);
    expected[0x50 + 2 * i] = static_cast<std::uint8_t>(high[i] / 256);
    expected[0x51 + 2 * i] = static_cast<std::uint8_t>(high[i] % 256);
  }
  expected[0x90] = 1;
  expected[0xB0] = 258 % 256;
  expected[0xB1] = 258 / 256;
  for (std::uint16_t at = 0; at < 1024; at = static_cast<std::uint16_t>(at + 8)) {
    const auto octets = read(swarm, 258, at);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(octets[i], expected[at + i]) << "address " << at + i;
  }
  EXPECT_EQ(swarm.hosts[0]->eeprom(258), nullptr) << "reading allocates nothing";
}

TEST(Eeprom, ContentIsPerRobotAndSurvivesAReset) {
  Swarm swarm({program(kReader)}, 3);
  swarm.start();
  IrMessage write = message(2);
  write[0] = 0x10;
  write[1] = 2;
  write[2] = 42;
  Air air;
  air.receptions = {{1, write}};
  swarm.step(air);
  ASSERT_NE(swarm.hosts[0]->eeprom(1), nullptr);
  EXPECT_EQ(swarm.hosts[0]->eeprom(0), nullptr);
  EXPECT_EQ((*swarm.hosts[0]->eeprom(1))[0x210], 42);
  EXPECT_EQ((*swarm.hosts[0]->eeprom(1))[0xB0], 1) << "the rest is as it was";
  air.receptions = {{1, message(kReset)}};
  swarm.step(air);
  air.receptions = {{1, message(kRun)}};
  swarm.step(air);
  EXPECT_EQ(read(swarm, 1, 0x210)[0], 42);
  EXPECT_EQ(read(swarm, 2, 0x210)[0], 0xff);
}

TEST(Eeprom, CalibrationIsSavedToItAndHoldsAfterAReset) {
  Swarm swarm(
      {program("static message_t m; static message_t* tx(void) { m.data[0] = kilo_uid & 255; m.data[1] = kilo_uid "
               ">> 8;\n"
               "  m.data[2] = kilo_turn_left; m.data[3] = kilo_turn_right; m.data[4] = kilo_straight_left;\n"
               "  m.data[5] = kilo_straight_right; return &m; }")},
      1);
  const auto reported = [&] {
    swarm.step(heard(message(kRun)));
    Air ask;
    ask.ask = {0};
    swarm.step(ask);
    const IrMessage m = swarm.frame().offer_message.at(0);
    return std::vector<int>(m.begin(), m.begin() + 6);
  };
  swarm.step();
  for (const IrMessage& m : {calib(kUid, 0x1234), calib(kTurnLeft, 0, 61), calib(kTurnRight, 0, 0, 62),
                             calib(kStraight, 0, 0, 0, 63, 64)}) {
    swarm.step(heard(m));
    EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kMoving);
  }
  EXPECT_EQ(swarm.frame().motor_left[0], 63);
  EXPECT_EQ(swarm.hosts[0]->eeprom(0), nullptr) << "tried, not saved";
  swarm.step(heard(calib(kSave)));
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.frame().motor_left[0], 0);
  const std::vector<int> saved{0x34, 0x12, 61, 62, 63, 64};
  EXPECT_EQ(reported(), saved);
  swarm.step(heard(message(kReset)));
  EXPECT_EQ(reported(), saved);
  const auto& octets = *swarm.hosts[0]->eeprom(0);
  EXPECT_EQ((std::vector<int>{octets[0xB0], octets[0xB1], octets[5], octets[9], octets[0xC], octets[0x14]}), saved);
}

TEST(Eeprom, WithoutSavingAResetBringsTheOldCalibrationBack) {
  Swarm swarm({program("static void loop(void) { set_motors(kilo_straight_left, kilo_turn_right); }")}, 1);
  swarm.step();
  swarm.step(heard(calib(kStraight, 0, 0, 0, 99, 98)));
  swarm.step(heard(message(kReset)));
  swarm.step(heard(message(kRun)));
  EXPECT_EQ(swarm.frame().motor_left[0], 70);
  EXPECT_EQ(swarm.frame().motor_right[0], 60);
}

TEST(Eeprom, GoesThroughCheckpoints) {
  Swarm first({program(kReader)}, 6, 2), second({program(kReader)}, 6, 3);
  first.start();
  IrMessage write = message(2, 0x30);
  write[2] = 7;
  Air air;
  air.receptions = {{4, write}};
  first.step(air);
  std::vector<proto::BehavioursState> parts(2);
  std::vector<const proto::BehavioursState*> pointers;
  for (std::size_t h = 0; h < 2; ++h) {
    first.hosts[h]->save(parts[h]);
    pointers.push_back(&parts[h]);
  }
  for (const auto& host : second.hosts) host->load(first.tick, pointers);
  second.tick = first.tick;
  EXPECT_EQ(read(second, 4, 0x30)[0], 7);
  EXPECT_EQ(read(second, 3, 0x30)[0], 244 / 256) << "the table's, as calibration has left it";
}

}  // namespace
}  // namespace kilotwin::behaviours::test

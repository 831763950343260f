// Firmware robots beside native ones: both behave alike, with the same result on any number of threads.
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "tests/services/comm/firmware/programs.hpp"
#include "tests/services/comm/firmware/timeline.hpp"

namespace kilotwin::firmware {
namespace {

namespace fs = std::filesystem;

class FirmwareRun : public testing::Test {
 protected:
  FirmwareRun() : folder_(fs::temp_directory_path() / ("kilotwin-firmware-run-" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~FirmwareRun() override { fs::remove_all(folder_); }

  std::string program(const std::string& name, const std::string& source) const {
    std::ofstream(folder_ / name) << source;
    return "behaviour: \"" + (folder_ / name).string() + "\" ";
  }
  [[nodiscard]] Timeline run(const std::string& experiment, std::uint32_t threads = 1,
                             const std::vector<std::string>& set = {}) {
    return run_timeline(experiment, folder_ / std::to_string(runs_++), threads, set);
  }

  const fs::path folder_;
  int runs_ = 0;
};

/// A program that shows the numbers of its sent and received messages in its motors, and the last sender in its LED.
const std::string kTalker = whole_program(
    "static message_t hello; static uint8_t sent, heard;\n"
    "static message_t* send(void) { return &hello; }\n"
    "static void note(void) { ++sent; }\n"
    "static void receive(message_t* m, distance_measurement_t* d) { (void)d; ++heard; set_color(m->data[0] + 1); "
    "}\n"
    "static void setup(void) { hello.data[0] = kilo_uid; hello.crc = message_crc(&hello); }\n"
    "static void loop(void) { set_motors(sent, heard); }\n",
    "kilo_message_tx = send; kilo_message_rx = receive; kilo_message_tx_success = note;");

std::string pair_of(const std::string& behaviour, const std::string& kind) {
  return "duration_s: 40 seed: 5 radio { oscillator_sd: 0 range_mm: 300 } recording { messages: true }\n"
         "robots { count: 2 " +
         behaviour + kind + " layout { grid { pitch_mm: 100 heading: HEADING_FIXED } } }\n";
}

TEST_F(FirmwareRun, SendsAndReceivesWhenANativeRobotDoes) {
  const std::string talker = program("talker.c", kTalker);
  const Timeline native = run(pair_of(talker, "")), firmware = run(pair_of(talker, "avr: true"));
  const std::int64_t end = native.totals.last.count();
  const Agreement motors = agreement(native.motors, firmware.motors, end),
                  led = agreement(native.led, firmware.led, end);
  EXPECT_GT(motors.first, 100u);
  EXPECT_TRUE(motors.whole()) << motors.first << ' ' << motors.second << ' ' << motors.same;
  EXPECT_GE(led.first, 2u);
  EXPECT_TRUE(led.whole()) << led.first << ' ' << led.second << ' ' << led.same;
  EXPECT_EQ(native.totals.sent, firmware.totals.sent);
  EXPECT_EQ(native.totals.received, firmware.totals.received);
}

TEST_F(FirmwareRun, NobodyHearsAWrongCrc) {
  std::string wrong = kTalker;
  const std::string right = "message_crc(&hello)";
  wrong.replace(wrong.find(right), right.size(), right + " + 1");
  const std::string talker = program("talker.c", wrong);
  for (const char* const kind : {"", "avr: true"}) {
    const Timeline timeline = run(pair_of(talker, kind));
    EXPECT_EQ(timeline.totals.received, 0u) << kind;
    for (std::size_t robot = 0; robot < 2; ++robot) {
      EXPECT_GT(timeline.motors[robot].back().value >> 8, 60u) << kind << " sent";
      EXPECT_EQ(timeline.motors[robot].back().value & 0xff, 0u) << kind << " heard";
    }
  }
  const Timeline mixed =
      run("duration_s: 10 radio { range_mm: 300 }\n"
          "robots { count: 1 " +
          talker +
          " }\n"
          "robots { count: 1 avr: true " +
          talker + " layout { x_mm: 60 } }\n");
  for (std::size_t robot = 0; robot < 2; ++robot) {
    EXPECT_GT(mixed.motors[robot].back().value >> 8, 12u) << "sent";
    EXPECT_EQ(mixed.motors[robot].back().value & 0xff, 0u) << "heard";
  }
}

TEST_F(FirmwareRun, MovesWhenANativeRobotDoes) {
  // The robot reads kilo_ticks octet by octet, so an interrupt may come in between: the next test. This program prevents that.
  std::ifstream file(KILOTWIN_SOURCE_DIR "/behaviours/walk.c");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  for (std::size_t at = 0; (at = text.find("kilo_ticks", at)) != std::string::npos; at += 5)
    text.replace(at, std::strlen("kilo_ticks"), "now()");
  const std::string include = "#include <kilolib.h>\n";
  ASSERT_NE(text.find(include), std::string::npos);
  text.replace(text.find(include), include.size(),
               include +
                   "#include <avr/interrupt.h>\n"
                   "static uint32_t now(void) { cli(); const uint32_t t = kilo_ticks; sei(); return t; }\n");
  const std::string walk = program("walk.c", text);
  const Timeline native = run(pair_of(walk, "")), firmware = run(pair_of(walk, "avr: true"));
  const std::int64_t end = native.totals.last.count();
  const Agreement motors = agreement(native.motors, firmware.motors, end),
                  led = agreement(native.led, firmware.led, end);
  EXPECT_GE(motors.first, 12u);
  EXPECT_TRUE(motors.whole()) << motors.first << ' ' << motors.second << ' ' << motors.same;
  EXPECT_TRUE(led.whole()) << led.first << ' ' << led.second << ' ' << led.same;
}

/// Programs that set their motors several times in a tick, and the part of the speed straight on that they reach.
struct Pulses {
  const char* loop;
  double part;
};

TEST_F(FirmwareRun, MovesAsFarWhereMotorsChangeWithinATick) {
  constexpr double kTick_ms = 32.768, kSpinUp = 1.5;  // full duty: the model's top_speed_ratio
  const Pulses all[] = {
      // Once per tick, at the same place of it: what the tick ends with is not what it was.
      {"uint32_t t = kilo_ticks; set_motors(kilo_straight_left, kilo_straight_right); delay(10); set_motors(0, "
       "0);\n"
       "while (kilo_ticks == t);",
       10 / kTick_ms},
      {"set_motors(kilo_straight_left, kilo_straight_right); delay(6); set_motors(0, 0); delay(6);", 0.5},
      {"spinup_motors(); set_motors(kilo_straight_left, kilo_straight_right); delay(40);",
       (15 * kSpinUp + 40) / 55.0},
      {"spinup_motors(); set_motors(0, 0); delay(5);", 15 * kSpinUp / 20},
      // Each call leaves the memory as it was; it counts nevertheless.
      {"set_motors(kilo_straight_left, kilo_straight_right); for (volatile uint16_t n = 0; n < 3000; ++n); "
       "set_motors(0, 0);",
       1},
      {"OCR2A = kilo_straight_left; OCR2B = kilo_straight_right; delay(10); OCR2A = OCR2B = 0; delay(10);", 0.5},
  };
  for (const Pulses& one : all) {
    const std::string source = program(
        "pulses.c",
        whole_program("static void setup(void) {}\nstatic void loop(void) { " + std::string(one.loop) + " }\n"));
    const auto path_mm = [&](const std::string& kind) {
      return run("duration_s: 30 seed: 3 motion { noise: false } radio { oscillator_sd: 0 }\nrobots { count: 1 " +
                 source + kind + " layout { grid {} } }\n")
          .path_mm[0];
    };
    const double native_mm = path_mm(""), firmware_mm = path_mm("avr: true");
    EXPECT_NEAR(native_mm, firmware_mm, 0.02 * firmware_mm) << one.loop;
    EXPECT_NEAR(native_mm, 10 * one.part * 30, 0.03 * native_mm) << one.loop;
  }
}

/// kilo_ticks has four octets, and the robot's processor reads them one by one. If the clock's interrupt comes in between while the
/// lowest carries over, the program sees a time up to 255 ticks ahead.
TEST_F(FirmwareRun, DiffersFirstWhereTheClockCarriesOver) {
  const std::string walk = "behaviour: \"" KILOTWIN_SOURCE_DIR "/behaviours/walk.c\" ";
  int early = 0;
  for (const char* const seed : {"seed=1", "seed=2", "seed=3", "seed=4", "seed=5"}) {
    const Timeline native = run(pair_of(walk, ""), 1, {seed}),
                   firmware = run(pair_of(walk, "avr: true"), 1, {seed});
    for (std::size_t robot = 0; robot < 2; ++robot) {
      const auto &a = native.led[robot], &b = firmware.led[robot];
      std::size_t n = 0;
      while (n < a.size() && n < b.size() && std::abs(a[n].tick - b[n].tick) <= 1) ++n;
      if (n >= std::min(a.size(), b.size())) continue;
      ++early;
      EXPECT_LT(b[n].tick, a[n].tick) << "the firmware's clock seems ahead";
      const std::int64_t past_carry = b[n].tick % 256;
      EXPECT_LE(past_carry, 3) << seed << " robot " << robot << " tick " << b[n].tick;
    }
  }
  EXPECT_LT(early, 10) << "it is rare";
}

TEST_F(FirmwareRun, ResultDoesNotDependOnThreadsAndHosts) {
  const std::string talker = program("talker.c", kTalker);
  const std::string experiment =
      "duration_s: 6 radio { range_mm: 300 loss: 0.05 } recording { messages: true }\n"
      "robots { count: 3 " +
      talker +
      " layout { grid {} } }\n"
      "robots { count: 4 avr: true " +
      talker + " layout { x_mm: 100 grid {} } }\n";
  const Timeline one = run(experiment);
  EXPECT_GT(one.totals.received, 50u);
  for (const std::uint32_t threads : {2u, 5u}) {
    EXPECT_EQ(run(experiment, threads).totals.state_hash, one.totals.state_hash) << threads;
  }
  EXPECT_EQ(run(experiment, 2, {"deployment.hosts=3", "deployment.partition_columns=2"}).totals.state_hash,
            one.totals.state_hash);
  EXPECT_NE(run(experiment, 1, {"seed=2"}).totals.state_hash, one.totals.state_hash);
}

TEST_F(FirmwareRun, FailsAloneAndReportsIt) {
  const std::string wild = program("wild.c", whole_program("static void setup(void) {} static void loop(void) { if "
                                                           "(kilo_ticks > 60) *(volatile uint8_t*)0xabcd = 1; }"));
  const std::string talker = program("talker.c", kTalker);
  const Timeline timeline =
      run("duration_s: 6 radio { range_mm: 300 }\n"
          "robots { count: 1 avr: true " +
          wild +
          " }\n"
          "robots { count: 2 avr: true " +
          talker + " layout { x_mm: 100 grid {} } }\n");
  EXPECT_EQ(timeline.totals.robots_failed, 1u);
  EXPECT_GT(timeline.totals.sent, 15u);
}

TEST_F(FirmwareRun, ReadsTheValuesOfANativeRobot) {
  // A robot's first duties show its reading in setup() at its start, while no message was arriving.
  const std::string reader = program(
      "reader.c",
      whole_program(
          "static int16_t wait_for(int16_t read(void)) { int16_t r; do r = read(); while (r < 0); return r; }\n"
          "static void setup(void) { delay(200); set_motors(wait_for(get_ambientlight) / 4, "
          "(wait_for(get_voltage) + wait_for(get_temperature)) & 255); }\n"
          "static void loop(void) {}\n"));
  const auto first_duties = [&](const std::string& kind) {
    const Timeline timeline =
        run("duration_s: 2 seed: 7 radio { range_mm: 300 } motion { noise: false }\n"
            "light { ambient: 30 source { x_mm: 120 height_mm: 150 intensity: 6 } shadows: true sensor { "
            "noise_floor: 0 noise_relative: "
            "0 } } temperature { celsius: 40 reading_sd: 0 } battery { charge: 0.6 charge_sd: 0.2 reading_sd: 0 }\n"
            "robots { count: 6 " +
            reader + kind + " layout { grid { pitch_mm: 40 } } }\n");
    std::vector<std::uint32_t> result;
    for (const auto& changes : timeline.motors) result.push_back(changes.at(0).value);
    return result;
  };
  const auto native = first_duties(""), firmware = first_duties("avr: true");
  std::set<std::uint32_t> different;
  for (std::size_t i = 0; i < native.size(); ++i) {
    EXPECT_NEAR(native[i] >> 8, firmware[i] >> 8, 1) << "light of robot " << i;
    EXPECT_NEAR(native[i] & 255, firmware[i] & 255, 2) << "voltage and temperature of robot " << i;
    different.insert(native[i] >> 8);
  }
  EXPECT_GE(different.size(), 4u) << "they stand in different light";
}

TEST_F(FirmwareRun, AnEmptyBatterySwitchesItOff) {
  // After some 20 s of white light the battery is empty. A charger, which gives more than an idle robot draws, restarts the robot.
  const std::string lamp = program("lamp.c", whole_program("static void setup(void) { set_color(RGB(3, 3, 3)); }\n"
                                                           "static void loop(void) {}\n"));
  const auto dark_at = [&](const std::string& kind) {
    const Timeline timeline =
        run("duration_s: 60 seed: 3 battery { capacity_mAh: 0.1 charger { radius_mm: 50 current_mA: 8 } }\n"
            "robots { count: 1 " +
            lamp + kind + " }\n");
    std::int64_t tick = 0;
    int lit = 0;
    for (std::size_t n = 0; n + 1 < timeline.led[0].size(); ++n) {
      if (timeline.led[0][n].value != 63) continue;
      tick = timeline.led[0][n + 1].tick;
      ++lit;
    }
    EXPECT_EQ(lit, 1) << "it does not run again by itself";
    return static_cast<double>(tick);
  };
  const double native = dark_at(""), firmware = dark_at("avr: true");
  EXPECT_GT(native, 300);
  EXPECT_NEAR(native, firmware, 5);
}

TEST_F(FirmwareRun, TextThatCannotBeWrittenAtTheEndFailsTheRun) {
  // The text waits until the end of the run, because nothing is printed later.
  const std::string prints = program("prints.c",
                                     "#define DEBUG\n#include <kilolib.h>\n#include <debug.h>\n"
                                     "static void setup(void) { printf(\"ready\\n\"); }\n"
                                     "static void loop(void) {}\nint main(void) { kilo_init(); "
                                     "debug_init(); kilo_start(setup, loop); return 0; }\n");
  for (const char* avr : {"false", "true"}) {
    const Timeline timeline =
        run_timeline("duration_s: 0.3 robots { count: 1 " + prints + " avr: " + avr + " layout {} }\n",
                     folder_ / std::to_string(runs_++), 1, {}, {},
                     [](const fs::path& run) { std::ofstream(run / "logs") << "a file in place of the folder"; });
    EXPECT_NE(timeline.totals.failure.find("logs/robot-00000.txt: cannot be created"), std::string::npos)
        << avr << timeline.totals.failure;
  }
}

TEST_F(FirmwareRun, ExchangesMessagesWithNativeRobots) {
  const std::string talker = program("talker.c", kTalker);
  const Timeline timeline =
      run("duration_s: 10 radio { range_mm: 300 } recording { messages: true }\n"
          "robots { count: 1 " +
          talker +
          " }\n"
          "robots { count: 1 avr: true " +
          talker + " layout { x_mm: 60 } }\n");
  for (std::size_t robot = 0; robot < 2; ++robot) {
    ASSERT_FALSE(timeline.led[robot].empty());
    EXPECT_EQ(timeline.led[robot].back().value, 2 - robot) << "who spoke last: the other";
    EXPECT_GT(timeline.motors[robot].back().value & 0xff, 12u) << "messages heard";
    EXPECT_GT(timeline.motors[robot].back().value >> 8, 12u) << "messages sent";
  }
}

TEST_F(FirmwareRun, HasItsUidAndEeprom) {
  const std::string shows = program(
      "shows.c", "#include <avr/eeprom.h>\n" + whole_program("static void setup(void) { set_motors(kilo_uid & 255, "
                                                             "eeprom_read_byte((uint8_t*)300)); }\n"
                                                             "static void loop(void) {}\n"));
  fs::create_directories(folder_ / "eeproms");
  std::string eeprom(1024, '\xff');
  eeprom[0xb0] = 77, eeprom[0xb1] = 0, eeprom[300] = 33;
  std::ofstream(folder_ / "eeproms/1.eeprom") << eeprom;
  for (const char* const kind : {"", "avr: true "}) {
    const Timeline timeline = run("duration_s: 2 robots { count: 2 first_uid: 42 " + shows + kind + "eeprom: \"" +
                                  (folder_ / "eeproms").string() + "\" layout { grid {} } }\n");
    ASSERT_FALSE(timeline.motors[0].empty() || timeline.motors[1].empty()) << kind;
    EXPECT_EQ(timeline.motors[0].back().value >> 8, 42u) << kind;
    EXPECT_EQ(timeline.motors[1].back().value, 77u << 8 | 33) << kind;
  }
}

TEST_F(FirmwareRun, FindsCompanionFilesAsNativeRobotsDo) {
  std::ofstream(folder_ / "light.c") << "#include <kilolib.h>\nvoid shine(void) { set_color(RGB(0, 3, 0)); }\n";
  const std::string lamp = program(
      "lamp.c",
      whole_program("void shine(void);\nstatic void setup(void) { shine(); }\nstatic void loop(void) {}\n"));
  for (const char* const kind : {"", "avr: true "})
    EXPECT_EQ(run("duration_s: 1 robots { count: 1 " + lamp + kind + "}\n").led[0].back().value, 12u) << kind;
}

/// rand_hard() keeps interrupts off, so it loses messages; about as many on the robot's processor as natively.
TEST_F(FirmwareRun, RandHardLosesMessagesAsANativeRobotDoes) {
  const std::string talker = program("talker.c", kTalker);
  const std::string rolls =
      program("rolls.c", whole_program("static uint8_t heard;\n"
                                       "static void receive(message_t* m, distance_measurement_t* d) { ++heard; }\n"
                                       "static void setup(void) {}\n"
                                       "static void loop(void) { for (uint8_t i = 0; i < 10; ++i) rand_hard(); "
                                       "set_motors(0, heard); delay(10); }\n",
                                       "kilo_message_rx = receive;"));
  const auto heard = [&](const std::string& kind) {
    const Timeline timeline =
        run("duration_s: 100 seed: 5 radio { range_mm: 300 }\n"
            "robots { count: 1 " +
            talker +
            " }\n"
            "robots { count: 1 loop_rate: AS_ON_ROBOT " +
            rolls + kind + " layout { x_mm: 60 } }\n");
    return static_cast<double>(timeline.motors[1].back().value & 0xff);
  };
  const double native = heard(""), firmware = heard("avr: true ");
  EXPECT_LT(native, 150) << "of 190";
  EXPECT_NEAR(native, firmware, 40);
}

}  // namespace
}  // namespace kilotwin::firmware

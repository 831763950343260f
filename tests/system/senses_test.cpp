// Light, shadows, batteries and EEPROMs in whole runs: one hash for every division, and one line for bad input.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

class Senses : public testing::Test {
 protected:
  Senses() {
    // The picture is bright on the right.
    std::string pixels;
    for (int i = 0; i < 64 * 16; ++i) pixels += static_cast<char>(4 * (i % 64));
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = 64;
    image.height = 16;
    image.format = PNG_FORMAT_GRAY;
    EXPECT_NE(png_image_write_to_file(&image, (scratch / "ramp.png").c_str(), 0, pixels.data(), 0, nullptr), 0);
    std::filesystem::create_directories(scratch.path() / "eeproms");
    std::string eeprom(1024, '\xff');
    eeprom[0x0C] = eeprom[0x14] = 90;
    write(scratch.path() / "eeproms/7.eeprom", eeprom);
    // Readings set motors and colours; every nth robot writes to its EEPROM.
    write(scratch.path() / "seek.c",
          "#include <kilolib.h>\n#include <avr/eeprom.h>\n"
          "static int16_t before; static message_t m; static message_t* tx(void) { return &m; }\n"
          "static void rx(message_t* r, distance_measurement_t* d) { m.data[0] += r->data[1]; }\n"
          "static void setup(void) {}\n"
          "static void loop(void) {\n"
          "  const int16_t light = get_ambientlight();\n"
          "  if (light < 0) return;\n"
          "  if (kilo_ticks % 16 == 0) { if (light < before) set_motors(kilo_turn_left, 0);\n"
          "    else set_motors(kilo_straight_left, kilo_straight_right); before = light; }\n"
          "  m.data[1] = light; set_color(light >> 4 & 63);\n"
          "  if (kilo_uid % 5 == 0 && kilo_ticks % 50 == 0) eeprom_write_byte((uint8_t*)300, get_voltage());\n}\n"
          "int main(void) { kilo_init(); kilo_message_tx = tx; kilo_message_rx = rx; kilo_start(setup, loop); "
          "return 0; }\n");
    write(scratch.path() / "senses.txtpb",
          "duration_s: 12 seed: 3 arena { width_mm: 600 height_mm: 600 }\n"
          "robots { count: 60 behaviour: \"seek.c\" eeprom: \"eeproms\" layout { grid { pitch_mm: 45 } } }\n"
          "light { ambient: 10 shadows: true\n"
          "  source { height_mm: 36 intensity: 5 circle { radius_mm: 220 period_s: 7 } }\n"
          "  source { x_mm: 250 height_mm: 200 intensity: 9 switch_s: [2, 3] switch_period_s: 4 }\n"
          "  image { png: \"ramp.png\" white: 300 } }\n"
          "battery { capacity_mAh: 0.1 charge_sd: 0.3 charge: 0.6 charger { x_mm: 100 y_mm: 50 radius_mm: 80 } }\n"
          "temperature {}\n");
  }
  Words experiment(const Words& more) const {
    Words words{scratch / "senses.txtpb"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Scratch scratch;
};

TEST_F(Senses, GiveOneHashForEveryDivision) {
  const auto whole =
      run(experiment({"--mode", "local", "--partitions", "1x1", "--checkpoint-every", "5"}), scratch, "whole");
  EXPECT_EQ(run(experiment({"--mode", "local", "--partitions", "3x2", "--hosts", "3", "--threads", "4"}), scratch,
                "local")
                .state_hash,
            whole.state_hash);
  EXPECT_EQ(run(experiment({"--partitions", "2x2", "--hosts", "2"}), scratch, "federated").state_hash,
            whole.state_hash);
  EXPECT_EQ(
      run(experiment({"--partitions", "2x1", "--hosts", "3", "--resume", scratch / "whole"}), scratch, "resumed")
          .state_hash,
      whole.state_hash);
  // The run directory gets the EEPROM of each robot that had or wrote one, in either mode.
  for (const char* const robot : {"7", "0", "55"}) {
    const std::string file = std::string("/eeprom/") + robot + ".eeprom";
    EXPECT_EQ(read(scratch / ("whole" + file)).size(), 1024u) << robot;
    EXPECT_EQ(read(scratch / ("whole" + file)), read(scratch / ("federated" + file)));
  }
  EXPECT_FALSE(std::filesystem::exists(scratch / "whole/eeprom/1.eeprom"));
  // The experiment as run starts again from the run directory alone.
  Words again{"run", scratch / "whole/experiment.txtpb", "--mode", "local", "--quiet", "--out", scratch / "again"};
  const Outcome outcome = kilotwin(again, scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(recorder::read_summary(scratch / "again/summary.json").state_hash, whole.state_hash);
  EXPECT_EQ(kilotwin({"replay", scratch / "whole", "--verify"}, scratch).status, 0);
}

TEST_F(Senses, ChangeTheResult) {
  const auto with = run(experiment({"--mode", "local", "--duration", "5"}), scratch, "with");
  for (const char* const change :
       {"light.shadows=false", "light.source[0].circle.period_s=8", "light.image.white=301", "battery.motor_mA=17",
        "light.sensor.noise_relative=0.07"}) {
    EXPECT_NE(run(experiment({"--mode", "local", "--duration", "5", "--set", change}), scratch, change).state_hash,
              with.state_hash)
        << change;
  }
}

TEST_F(Senses, RefuseFilesThatCannotBeRead) {
  const auto refused = [&](const Words& set, const std::string& why) {
    Words words{"run", scratch / "senses.txtpb", "--mode", "local", "--out", scratch / "none"};
    for (const std::string& one : set) words.insert(words.end(), {"--set", one});
    const Outcome outcome = kilotwin(words, scratch);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(scratch / "none"));
  };
  refused({"light.image.png=none.png"}, "cannot be read");
  refused({"light.image.png=seek.c"}, "PNG");
  refused({"light.source.waypoint.time_s=3"}, "circle and waypoint");
  refused({"light.source[1].switch_s[1]=1"}, "later");
  refused({"light.source[1].switch_period_s=2.5"}, "switch_period_s");
  refused({"robots.eeprom=nowhere"}, "nowhere");
  write(scratch.path() / "eeproms/3.eeprom", "short");
  refused({"seed=4"}, "has 5 octets");
}

/// Number of robots whose centre came within `radius_mm` of the origin.
std::size_t arrived(const std::string& trajectories, double radius_mm) {
  std::istringstream lines(trajectories);
  std::set<std::string> robots;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::string time, robot, x, y;
    std::getline(cells, time, ','), std::getline(cells, robot, ',');
    std::getline(cells, x, ','), std::getline(cells, y, ',');
    if (std::hypot(std::stod(x), std::stod(y)) < radius_mm) robots.insert(robot);
  }
  return robots.size();
}

/// Two ways to seek a lamp, with fixed thresholds and with the robot's own.
TEST(Phototaxis, BringsEighteenOfTwentyRobotsToALamp) {
  const Scratch scratch;
  for (const char* const behaviour : {"behaviours/move_to_light.c", "behaviours/phototaxis.c"}) {
    static_cast<void>(run({source("experiments/move_to_light.txtpb"), "--mode", "local", "--set",
                           std::string("robots.behaviour=") + source(behaviour)},
                          scratch, "run"));
    const Outcome exported = kilotwin({"export", scratch / "run", "--trajectories", "-", "--every", "2"}, scratch);
    ASSERT_EQ(exported.status, 0) << exported.err;
    EXPECT_GE(arrived(exported.out, 150), 18u) << behaviour;
    EXPECT_LE(arrived(exported.out.substr(0, exported.out.find("\n2.")), 150), 2u) << "at the start";
    std::filesystem::remove_all(scratch / "run");
  }
}

}  // namespace
}  // namespace kilotwin::test

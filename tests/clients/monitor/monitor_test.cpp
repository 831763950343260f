// The monitor: laws of its statistics under the model, then what it says of planted effects.
#include "clients/monitor/monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "tests/clients/monitor/virtual_arena.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::monitor {
namespace {

using testing::ArenaOptions;
using testing::VirtualArena;

constexpr double kTick_s = 0.032768;

/// A model with wheel noise of 1 mm per sqrt(s) at 10 mm/s.
std::string noisy(double factor_variance_s = 0.01) {
  return "motion { factor_variance_s: " + std::to_string(factor_variance_s) + " } ";
}

std::vector<Alarm> play(VirtualArena& arena, double seconds, std::array<double, 3> knock = {}) {
  std::vector<Alarm> alarms;
  const auto ticks = static_cast<int>(seconds / kTick_s);
  for (int k = 0; k < ticks; ++k) {
    arena.step(knock);
    for (Alarm& alarm : arena.monitor().take_alarms()) alarms.push_back(std::move(alarm));
  }
  return alarms;
}

std::string lines(const std::vector<Alarm>& alarms) {
  std::string text;
  for (const Alarm& alarm : alarms) text += line_of(alarm) + "\n";
  return text;
}

TEST(Monitor, WhitenedInnovationsAreStandardNormalUnderTheModel) {
  for (const bool tells_headings : {true, false}) {
    ArenaOptions options;
    options.robots = 20;
    options.side_mm = 2000;
    options.model = noisy();
    options.tells_headings = tells_headings;
    MonitorSettings settings;
    settings.command_jitter_s = 0;
    VirtualArena arena(options, settings);
    // Moments, lag-one correlation per robot, and the share beyond 1.96.
    struct Sums {
      double n = 0, sum = 0, squares = 0, lagged = 0, pairs = 0, beyond = 0;
    };
    std::array<Sums, 3> sums;
    std::vector<std::array<double, 3>> last(options.robots);
    arena.monitor().on_innovation = [&](const WatchedRobot& robot, const Innovation& innovation) {
      if (!robot.is_tested()) return;
      for (std::size_t d = 0; d < innovation.dimensions; ++d) {
        const double z = innovation.white[d];
        Sums& of = sums[d];
        of.n += 1;
        of.sum += z;
        of.squares += z * z;
        of.beyond += std::abs(z) > 1.96 ? 1 : 0;
        of.lagged += z * last[robot.id()][d];
        last[robot.id()][d] = z;
      }
    };
    const std::vector<Alarm> alarms = play(arena, 180);
    EXPECT_TRUE(alarms.empty()) << lines(alarms);
    for (std::size_t d = 0; d < (tells_headings ? 3u : 2u); ++d) {
      const Sums& of = sums[d];
      ASSERT_GT(of.n, 40'000);
      const double error = 1 / std::sqrt(of.n);
      EXPECT_NEAR(of.sum / of.n, 0, 5 * error) << d;
      EXPECT_NEAR(of.squares / of.n, 1, 0.03) << d;
      EXPECT_NEAR(of.lagged / of.n, 0, 0.02) << d;
      EXPECT_NEAR(of.beyond / of.n, 0.05, 0.005) << d;
    }
  }
}

TEST(Monitor, AnAlarmUnderTheModelIsRarerThanStated) {
  // A stated rate of 300 false alarms per hour: over 10 minutes at most 50 are expected.
  ArenaOptions options;
  options.robots = 12;
  options.side_mm = 2000;
  options.model = noisy();
  MonitorSettings settings;
  settings.false_alarms_per_hour = 300;
  VirtualArena arena(options, settings);
  const double minutes = 10;
  const std::vector<Alarm> alarms = play(arena, 60 * minutes);
  EXPECT_LE(static_cast<double>(alarms.size()), 300 * minutes / 60);
}

/// Ten robots; the left motor of robot 3 fails at 90 s.
ArenaOptions with_a_failing_motor() {
  ArenaOptions options;
  options.robots = 10;
  options.side_mm = 1500;
  options.model = noisy(0.001);
  options.faults =
      "effect { name: \"failed\" acts_on: WHEEL_GAIN wheel: LEFT_WHEEL robot: 3 function { of: TIME steps { at: "
      "90 "
      "value: 0 value: -1 } } }";
  return options;
}

TEST(Monitor, AMotorThatFailsIsNamed) {
  VirtualArena arena(with_a_failing_motor(), {});
  const std::vector<Alarm> alarms = play(arena, 130);
  ASSERT_FALSE(alarms.empty());
  EXPECT_EQ(alarms[0].robots, std::vector<std::uint32_t>{3}) << lines(alarms);
  EXPECT_EQ(alarms[0].suspect, Suspect::kGainLeft) << lines(alarms);
  EXPECT_GT(alarms[0].time_s, 90);
  EXPECT_LT(alarms[0].time_s, 110);
  EXPECT_NEAR(alarms[0].sizes[0].value, -1, 0.5);
  // Seconds of whole length, by time and robot; near 1 but for the faulty robot, from its failure on.
  double worst = 0, others = 0, before = 0;
  std::pair<double, std::uint32_t> last{0, 0};
  std::size_t rows = 0, rows_before = 0;
  for (const Residual& residual : arena.monitor().take_residuals()) {
    const std::pair<double, std::uint32_t> at{residual.to_s, residual.robot};
    EXPECT_LT(last, at);
    last = at;
    const double mean_square = residual.squares / (2 * residual.samples + residual.headings);
    if (residual.robot == 3 && residual.to_s > 90) worst = std::max(worst, mean_square);
    if (residual.robot == 3 && residual.to_s <= 90) before += mean_square, ++rows_before;
    if (residual.robot != 3) others += mean_square, ++rows;
  }
  EXPECT_EQ(last.first, 129);
  EXPECT_GT(worst, 2);  // 90 components: the standard deviation is 0.15 under the model
  EXPECT_NEAR(before / static_cast<double>(rows_before), 1, 0.15);
  EXPECT_NEAR(others / static_cast<double>(rows), 1, 0.1);
  RecordProperty("delay_ms", static_cast<int>(1e3 * (alarms[0].time_s - 90)));
}

/// Robots without shadows: the station's packets tell what they were commanded.
TEST(Monitor, AFailingMotorIsNamedFromTheStationsMessages) {
  MonitorSettings settings;
  settings.station_commands = station_commands_of("3=stop,4=straight,1=left,2=right");
  VirtualArena arena(with_a_failing_motor(), settings);
  const std::vector<Alarm> alarms = play(arena, 130);
  ASSERT_FALSE(alarms.empty());
  EXPECT_EQ(alarms[0].robots, std::vector<std::uint32_t>{3}) << lines(alarms);
  EXPECT_EQ(alarms[0].suspect, Suspect::kGainLeft) << lines(alarms);
  EXPECT_GT(alarms[0].time_s, 90);
  EXPECT_LT(alarms[0].time_s, 110);
  EXPECT_EQ(arena.monitor().totals().robots_watched, 10u);
}

TEST(Monitor, StationCommandsAreRead) {
  EXPECT_EQ(station_commands_of("1=left,15=stop"),
            (StationCommands{{1, MotionCommand::kTurnLeft}, {15, MotionCommand::kStop}}));
  for (const char* wrong : {"", "left", "1=", "16=left", "1=up", "1=left;2=right", "=left"})
    EXPECT_THROW(static_cast<void>(station_commands_of(wrong)), UserError) << wrong;
}

TEST(Monitor, AKnockedCameraIsNoFaultOfRobots) {
  ArenaOptions options;
  options.robots = 10;
  options.side_mm = 1500;
  options.model = noisy(0.001);
  options.tracker = "tracker { source: \"ceiling\" } ";
  VirtualArena arena(options, {});
  EXPECT_TRUE(play(arena, 80).empty());
  const std::vector<Alarm> alarms = play(arena, 20, {4, -2, 0.004});
  ASSERT_EQ(alarms.size(), 1u) << lines(alarms);
  EXPECT_EQ(alarms[0].suspect, Suspect::kCalibrationShift);
  EXPECT_EQ(alarms[0].tracker, "ceiling");
  EXPECT_LT(alarms[0].time_s, 82);
  EXPECT_NEAR(alarms[0].sizes[0].value, 4, 0.8);
  EXPECT_NEAR(alarms[0].sizes[1].value, -2, 0.8);
  EXPECT_NEAR(alarms[0].sizes[2].value, 0.004, 0.002);
}

TEST(Monitor, ARobotThatIsCarriedIsOneRobotsJump) {
  ArenaOptions options;
  options.robots = 10;
  options.side_mm = 1500;
  options.model = noisy(0.001);
  VirtualArena arena(options, {});
  EXPECT_TRUE(play(arena, 80).empty());
  arena.carry(5, 30, 10);
  const std::vector<Alarm> alarms = play(arena, 20);
  ASSERT_EQ(alarms.size(), 1u) << lines(alarms);
  EXPECT_EQ(alarms[0].suspect, Suspect::kJump) << lines(alarms);
  EXPECT_EQ(alarms[0].robots, std::vector<std::uint32_t>{5});
}

TEST(Monitor, ASlowPatchIsFoundBySeveralRobots) {
  ArenaOptions options;
  options.robots = 20;
  options.side_mm = 1000;
  options.model = noisy(0.001);
  options.faults =
      "effect { name: \"patch\" acts_on: WHEEL_GAIN function { constant: -0.4 } "
      "function { of: X steps { at: -80 at: 80 value: 0 value: 1 value: 0 } } "
      "function { of: Y steps { at: -80 at: 80 value: 0 value: 1 value: 0 } } "
      "function { of: TIME steps { at: 60 value: 0 value: 1 } } }";
  VirtualArena arena(options, {});
  const std::vector<Alarm> alarms = play(arena, 400);
  const auto patch = std::find_if(alarms.begin(), alarms.end(),
                                  [](const Alarm& alarm) { return alarm.suspect == Suspect::kPatch; });
  ASSERT_NE(patch, alarms.end()) << lines(alarms);
  EXPECT_LT(std::hypot(patch->x_mm, patch->y_mm), 150) << lines(alarms);
  EXPECT_GE(patch->robots.size(), 2u);
  EXPECT_LT(patch->sizes[0].value, 0);
}

}  // namespace
}  // namespace kilotwin::monitor

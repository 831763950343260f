#include "clients/doors/logs/log_player.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

class LogFile : public testing::Test {
 protected:
  LogFile()
      : path(std::filesystem::temp_directory_path() / ("kilotwin-log-" + std::to_string(getpid()) + "-" + name())) {
  }
  ~LogFile() override { std::filesystem::remove(path); }
  static std::string name() { return testing::UnitTest::GetInstance()->current_test_info()->name(); }
  void write(const std::string& text) const { std::ofstream(path, std::ios::binary) << text; }
  std::vector<LogPlayer::Due> played(const Door& door, double speed = 1, bool loop = false,
                                     std::size_t most = 100) {
    LogPlayer player(door, path, check_log(path, door.settings.log()), speed, loop);
    std::vector<LogPlayer::Due> all;
    while (all.size() < most) {
      auto due = player.next();
      if (!due) break;
      all.push_back(std::move(*due));
    }
    left_out = player.tally().in_words();
    return all;
  }
  std::filesystem::path path;
  std::string left_out;
};

TEST_F(LogFile, AnArkLogBecomesFramesInTheArena) {
  write("10\t0\t1\t1000\t900\t90\t1\t3\t0\t2000\t-180\n10.5\t0\t0\t1010\t900\t0\t1\t0\tnan\t2000\t0\n");
  const auto all = played(door("name: 'a' log { columns: 5 }", 3, 1));
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].after_ns, 0);
  EXPECT_EQ(all[1].after_ns, 500'000'000);
  EXPECT_EQ(all[1].frame.capture_ns, 500'000'000);
  EXPECT_EQ(all[1].frame.frame, 1u);
  const TrackedRobot& first = all[0].frame.robots.at(0);
  EXPECT_EQ(first.robot, 1u);
  EXPECT_DOUBLE_EQ(first.x_mm, 0);
  EXPECT_DOUBLE_EQ(first.y_mm, 100);
  EXPECT_NEAR(first.heading_rad, kPi / 2, 1e-12);
  EXPECT_EQ(first.led, 3);
  const TrackedRobot& second = all[0].frame.robots.at(1);
  EXPECT_DOUBLE_EQ(second.x_mm, -1000);
  EXPECT_DOUBLE_EQ(second.y_mm, -1000);
  EXPECT_NEAR(std::abs(second.heading_rad), kPi, 1e-12);
  EXPECT_EQ(all[1].frame.robots.size(), 1u) << "the second robot is lost";
  EXPECT_EQ(left_out, "2 frames with 3 poses; left out: 1 poses that are not finite (the first: number 1)");
}

TEST_F(LogFile, HeadingsOfLarsAreThoseOfTheVelocity) {
  write("1\n2\n3\n4\n5\n6\n7\n8\n9\n0\t0\t1\t2\t0\t0\t-2\t1\t1\t2\t0\t0\t0\n");
  const auto all = played(door("name: 'a' log { format: LARS columns: 6 } placement { unit_mm: 2 }", 2));
  EXPECT_NEAR(all.at(0).frame.robots.at(0).heading_rad, kPi / 2, 1e-12) << "upwards in the picture";
  EXPECT_DOUBLE_EQ(all[0].frame.robots[0].y_mm, -4);
  EXPECT_TRUE(std::isinf(all[0].frame.robots.at(1).heading_variance_rad2)) << "it stands";
}

TEST_F(LogFile, SpeedShortensAllTimesAlike) {
  write("5\t0\t0\t1\t1\t0\n6\t0\t0\t1\t1\t0\n9\t0\t0\t1\t1\t0\n");
  for (const double speed : {0.5, 1.0, 4.0}) {
    const auto all = played(door("name: 'a' log {}", 1), speed);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[1].after_ns, std::llround(1e9 / speed));
    EXPECT_EQ(all[2].after_ns, std::llround(4e9 / speed));
  }
}

TEST_F(LogFile, ALoopGoesOnWithoutAJumpOfTime) {
  write("5\t0\t0\t1\t1\t0\n6\t0\t0\t1\t1\t0\n7\t0\t0\t1\t1\t0\n");
  const auto all = played(door("name: 'a' log {}", 1), 1, true, 10);
  ASSERT_EQ(all.size(), 10u);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].after_ns, static_cast<std::int64_t>(i) * 1'000'000'000);
    EXPECT_EQ(all[i].frame.frame, i);
  }
}

TEST_F(LogFile, AnEmptyLogIsRefused) {
  write("\n\n");
  try {
    static_cast<void>(check_log(path, settings("log {}").log()));
    ADD_FAILURE();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find(":1:1: there is no row"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kilotwin::doors::test

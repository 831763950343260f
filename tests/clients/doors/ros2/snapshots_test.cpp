#include <gtest/gtest.h>

#include "clients/doors/ros2/messages.hpp"
#include "clients/doors/ros2/run_publisher.hpp"

namespace kilotwin::doors::ros2 {
namespace {

PublicRobotState state(std::uint32_t robot, double time_s, double x_mm, std::uint64_t run = 1) {
  PublicRobotState sample{};
  sample.robot = robot;
  sample.run = run;
  sample.time_s = time_s;
  sample.x_mm = x_mm;
  return sample;
}

TEST(Snapshots, TheLastRobotOfATimeCompletesIt) {
  Snapshots snapshots(2);
  EXPECT_FALSE(snapshots.add(state(1, 0.1, 11)));
  const auto all = snapshots.add(state(0, 0.1, 10));
  ASSERT_TRUE(all);
  EXPECT_DOUBLE_EQ(all->time_s, 0.1);
  EXPECT_DOUBLE_EQ(all->poses[0].x_mm, 10);
  EXPECT_DOUBLE_EQ(all->poses[1].x_mm, 11);
  EXPECT_FALSE(snapshots.add(state(0, 0.1, 10))) << "it was added before";
}

TEST(Snapshots, ALostSampleLeavesTheLastPose) {
  Snapshots snapshots(2);
  static_cast<void>(snapshots.add(state(0, 0.1, 1)));
  static_cast<void>(snapshots.add(state(1, 0.1, 2)));
  EXPECT_FALSE(snapshots.add(state(0, 0.2, 3)));
  const auto at_next_time = snapshots.add(state(0, 0.3, 5));
  ASSERT_TRUE(at_next_time);
  EXPECT_DOUBLE_EQ(at_next_time->time_s, 0.2);
  EXPECT_DOUBLE_EQ(at_next_time->poses[0].x_mm, 3);
  EXPECT_DOUBLE_EQ(at_next_time->poses[1].x_mm, 2);
}

TEST(Snapshots, NothingUntilEveryRobotWasSeen) {
  Snapshots snapshots(3);
  for (int tick = 1; tick < 10; ++tick) {
    EXPECT_FALSE(snapshots.add(state(0, tick, 0)));
    EXPECT_FALSE(snapshots.add(state(1, tick, 0)));
  }
  EXPECT_TRUE(snapshots.add(state(2, 9, 0)));
}

TEST(Snapshots, AnotherRunBeginsAnew) {
  Snapshots snapshots(2);
  static_cast<void>(snapshots.add(state(0, 5, 1)));
  ASSERT_TRUE(snapshots.add(state(1, 5, 2)));
  EXPECT_FALSE(snapshots.add(state(0, 0.1, 1, 2)));
  EXPECT_FALSE(snapshots.add(state(0, 0.2, 1, 2))) << "robot 1 of this run was not seen";
  EXPECT_TRUE(snapshots.add(state(1, 0.2, 1, 2)));
}

TEST(Snapshots, ARobotBeyondTheExperimentIsIgnored) {
  Snapshots snapshots(1);
  EXPECT_FALSE(snapshots.add(state(1, 0.1, 0)));
  EXPECT_TRUE(snapshots.add(state(0, 0.1, 0)));
}

TEST(Time, IsCutIntoSecondsAndNanoseconds) {
  const Time time = time_of(1'500'000'001);
  EXPECT_EQ(time.sec, 1);
  EXPECT_EQ(time.nanosec, 500'000'001u);
  EXPECT_EQ(time_of(std::numeric_limits<std::int64_t>::max()).sec, 2147483647);
}

}  // namespace
}  // namespace kilotwin::doors::ros2

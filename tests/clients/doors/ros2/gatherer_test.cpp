#include "clients/doors/ros2/gatherer.hpp"

#include <gtest/gtest.h>

#include <random>

namespace kilotwin::doors::ros2 {
namespace {

constexpr std::int64_t kHold_ns = 10;

std::vector<TrackedRobot> robots(std::initializer_list<std::uint32_t> ids) {
  std::vector<TrackedRobot> all;
  for (const std::uint32_t id : ids) {
    all.emplace_back();
    all.back().robot = id;
  }
  return all;
}

class Gathering : public testing::Test {
 protected:
  std::vector<TrackedFrame> add(std::int64_t stamp, std::initializer_list<std::uint32_t> ids, std::int64_t now,
                                bool whole = false) {
    return gatherer.add({stamp, whole, {}, robots(ids)}, now, tally);
  }
  Tally tally;
  Gatherer gatherer{kHold_ns};
};

TEST_F(Gathering, AMessageWithAllRobotsIsAFrame) {
  const auto frames = add(100, {3, 1}, 0, true);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].capture_ns, 100);
  EXPECT_EQ(frames[0].frame, 0u);
  ASSERT_EQ(frames[0].robots.size(), 2u);
  EXPECT_EQ(frames[0].robots[0].robot, 1u);
  EXPECT_EQ(add(101, {1}, 1, true).at(0).frame, 1u);
}

TEST_F(Gathering, MessagesOfOneStampAreOneFrame) {
  EXPECT_TRUE(add(100, {0}, 0).empty());
  EXPECT_TRUE(add(100, {1}, 1).empty());
  EXPECT_EQ(gatherer.deadline_ns(), kHold_ns);
  EXPECT_TRUE(gatherer.expire(kHold_ns - 1).empty());
  const auto first = gatherer.expire(kHold_ns);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].robots.size(), 2u);
  EXPECT_FALSE(gatherer.deadline_ns());
  // Both robots are known: the second one completes the frame.
  EXPECT_TRUE(add(200, {1}, 20).empty());
  EXPECT_EQ(add(200, {0}, 21).size(), 1u);
}

TEST_F(Gathering, ALostRobotCostsTheHoldTimeOnce) {
  add(100, {0}, 0);
  add(100, {1}, 0);
  static_cast<void>(gatherer.expire(kHold_ns));
  EXPECT_TRUE(add(200, {0}, 20).empty());
  EXPECT_EQ(gatherer.expire(30).size(), 1u);
  EXPECT_EQ(add(300, {0}, 40).size(), 1u) << "robot 1 is not waited for";
}

TEST_F(Gathering, ARobotThatCameLateIsWaitedFor) {
  add(100, {0}, 0);
  ASSERT_EQ(gatherer.expire(kHold_ns).size(), 1u);
  EXPECT_TRUE(add(100, {1}, 11).empty());
  EXPECT_EQ(tally.left_out_for("messages that came after the frame of their stamp"), 1u);
  EXPECT_TRUE(add(200, {0}, 20).empty());
  EXPECT_EQ(add(200, {1}, 21).at(0).robots.size(), 2u);
}

TEST_F(Gathering, FramesLeaveInTheOrderOfStamps) {
  add(100, {0}, 0);
  add(100, {1}, 0);
  static_cast<void>(gatherer.expire(kHold_ns));
  EXPECT_TRUE(add(200, {0}, 20).empty());
  EXPECT_TRUE(add(300, {0}, 21).empty());
  const auto frames = add(300, {1}, 22);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].capture_ns, 200);
  EXPECT_EQ(frames[1].capture_ns, 300);
}

TEST_F(Gathering, AClockThatGoesBackBeginsAnew) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  EXPECT_EQ(add(100 * kSecond, {0}, 0, true).size(), 1u);
  EXPECT_TRUE(add(100 * kSecond - kSecond / 2, {0}, 1, true).empty()) << "late";
  EXPECT_EQ(add(5 * kSecond, {0}, 2, true).size(), 1u);
  EXPECT_EQ(add(6 * kSecond, {0}, 3, true).at(0).frame, 2u);
}

TEST_F(Gathering, ARobotIsOnceInAFrame) {
  add(100, {0, 0}, 0);
  add(100, {0}, 1);
  EXPECT_EQ(gatherer.expire(kHold_ns).at(0).robots.size(), 1u);
  EXPECT_EQ(tally.left_out_for("poses of a robot that the frame has already"), 2u);
}

TEST_F(Gathering, TheTrackersOwnFrameNumbersStay) {
  const auto frames = gatherer.add({100, true, 77, robots({0})}, 0, tally);
  EXPECT_EQ(frames.at(0).frame, 77u);
}

/// In any order of the messages, stamps of frames ascend, no robot is twice in a frame, and poses are conserved.
TEST_F(Gathering, ConservesPosesInAnyOrder) {
  std::mt19937_64 random(7);
  std::vector<std::pair<std::int64_t, std::uint32_t>> messages;
  for (std::int64_t stamp = 1; stamp <= 200; ++stamp) {
    for (std::uint32_t robot = 0; robot < 5; ++robot) messages.emplace_back(stamp * 100, robot);
  }
  for (std::size_t i = 0; i + 8 < messages.size(); ++i) std::swap(messages[i], messages[i + random() % 8]);
  std::size_t poses = 0;
  std::int64_t last = 0;
  const auto look = [&](const std::vector<TrackedFrame>& frames) {
    for (const TrackedFrame& frame : frames) {
      EXPECT_GT(frame.capture_ns, last);
      last = frame.capture_ns;
      poses += frame.robots.size();
      for (std::size_t i = 1; i < frame.robots.size(); ++i)
        EXPECT_LT(frame.robots[i - 1].robot, frame.robots[i].robot);
    }
  };
  std::int64_t now = 0;
  for (const auto& [stamp, robot] : messages) look(gatherer.add({stamp, false, {}, robots({robot})}, ++now, tally));
  look(gatherer.expire(now + kHold_ns));
  const std::uint64_t late = tally.left_out_for("messages that came after the frame of their stamp");
  EXPECT_EQ(poses + late, messages.size());
  EXPECT_GT(poses, messages.size() / 2);
}

}  // namespace
}  // namespace kilotwin::doors::ros2

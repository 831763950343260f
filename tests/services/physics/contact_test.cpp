// Contact between discs and with walls: safety, sliding, pushing, symmetry.
#include "services/physics/contact.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::largest_overlap_mm;
using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kQuiet;
using testing::kTick_s;

TEST(Contact, HeadOnRobotsStopWhereTheyMeet) {
  const RunPlan plan = make_plan(kQuiet, {{-30, 0, 0}, {30, 0, kPi}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(300);
  const auto poses = swarm.poses();
  // A contact carries force up to a gap of two strides, and robots rest where their forces first balance.
  EXPECT_NEAR(poses[0].x_mm, -16.5, 0.2);
  EXPECT_NEAR(poses[1].x_mm, -poses[0].x_mm, 1e-9);
  EXPECT_NEAR(poses[0].y_mm, 0, 1e-9);
  EXPECT_LE(largest_overlap_mm(poses), 1e-9);
}

TEST(Contact, FasterOfTwoHeadOnRobotsPushesByHalfTheDifference) {
  const RunPlan plan = make_plan(kQuiet, {{-20, 0, 0}, {20, 0, -kPi}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  swarm.set_motors(1, 35, 35);
  swarm.run(300);
  const double before_mm = swarm.poses()[0].x_mm;
  swarm.run(100);
  EXPECT_NEAR((swarm.poses()[0].x_mm - before_mm) / (100 * kTick_s), 2.5, 1e-6);
}

TEST(Contact, APushEndsWithTheDrive) {
  const RunPlan plan = make_plan(kQuiet, {{0, 0, 0}, {34, 0, 1}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  swarm.run(100);
  swarm.set_motors(0, 0, 0);
  const auto before = swarm.poses();
  swarm.run(100);
  EXPECT_EQ(swarm.poses()[1].x_mm, before[1].x_mm);
  EXPECT_NEAR(swarm.poses()[0].x_mm, before[0].x_mm, 0.02);  // The contact force decays within a tick or two.
}

TEST(Contact, OneRobotDoesNotPushTwoInARow) {
  // The force of one drive holds one resting robot: motors in ARGoS and Kilombo hold with the force with which they push.
  const RunPlan plan = make_plan(kQuiet, {{-33, 0, 0}, {0, 0, 0}, {33, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  swarm.run(200);
  EXPECT_NEAR(swarm.poses()[2].x_mm, 33, 1e-9);
}

TEST(Contact, AFollowerNeitherCatchesNorPushesItsLeader) {
  const RunPlan plan = make_plan(kQuiet, {{0, 0, 0}, {33, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(100);
  const auto poses = swarm.poses();
  EXPECT_NEAR(poses[1].x_mm, 33 + 10 * 100 * kTick_s, 1e-9);
  EXPECT_NEAR(poses[1].x_mm - poses[0].x_mm, 33, 0.25);
  EXPECT_GE(poses[1].x_mm - poses[0].x_mm, 33 - 1e-9);
}

TEST(Contact, ARobotSlidesRoundAnImmovableOne) {
  const std::string text =
      kQuiet + "physics { rim_friction: 0 } robots { count: 1 } robots { count: 1 body: TRACKED }";
  const RunPlan plan = make_plan(text, {{-60, 8, 0}, {0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  double least_mm = 1e9;
  for (int k = 0; k < 800; ++k) {
    swarm.step();
    const auto poses = swarm.poses();
    least_mm = std::min(least_mm, std::hypot(poses[0].x_mm, poses[0].y_mm));
  }
  EXPECT_GE(least_mm, 33 - 1e-9);
  EXPECT_LE(least_mm, 33.1);  // Contacts carry force slightly before rims touch.
  const auto poses = swarm.poses();
  EXPECT_GT(poses[0].x_mm, 60);    // past it
  EXPECT_GT(poses[0].y_mm, 32.9);  // at the height to which it slid
  EXPECT_EQ(poses[1].x_mm, 0);
  EXPECT_EQ(poses[1].y_mm, 0);
}

TEST(Contact, FrictionHoldsARobotUpToItsAngle) {
  // It meets the other robot 14.03 degrees off its course: friction below tan(14.03 degrees) = 0.2499 lets it slide past.
  for (const double friction : {0.24, 0.26, 6.25}) {
    const RunPlan plan = make_plan(kQuiet + "physics { rim_friction: " + std::to_string(friction) +
                                       " } robots { count: 1 } robots { count: 1 body: TRACKED }",
                                   {{-60, 8, 0}, {0, 0, 0}});
    Swarm swarm(plan);
    swarm.set_motors(0, 70, 70);
    swarm.run(400);
    const auto before = swarm.poses()[0];
    swarm.run(2400);
    const auto after = swarm.poses()[0];
    if (friction < 0.25) {
      EXPECT_GT(after.x_mm, 60);
    } else {
      EXPECT_EQ(after.x_mm, before.x_mm) << friction;
      EXPECT_EQ(after.y_mm, before.y_mm) << friction;
    }
  }
}

TEST(Contact, ATurningRobotDragsTheRobotItPresses) {
  // Two robots press on each other, and one also turns to its left: at the contact its rim moves towards -y.
  const auto sideways_mm = [](const std::string& friction) {
    const RunPlan plan =
        make_plan(kQuiet + "physics { rim_friction: " + friction + " }", {{-16.6, 0, 0}, {16.6, 0, -kPi}});
    Swarm swarm(plan);
    swarm.set_motors(0, 70, 70);
    swarm.set_motors(1, 90, 50);
    swarm.run(30);
    return swarm.poses()[0].y_mm;
  };
  EXPECT_LT(sideways_mm("6.25"), sideways_mm("0") - 2);
  EXPECT_LT(sideways_mm("0.5"), sideways_mm("0") - 2);
}

TEST(Contact, ARobotSlidesAlongAWallWithItsTangentialSpeed) {
  const RunPlan plan = make_plan(kQuiet + "arena { width_mm: 2000 height_mm: 200 }", {{0, 80, kPi / 4}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(100);
  const ScenePose before = swarm.poses()[0];
  swarm.run(100);
  const ScenePose after = swarm.poses()[0];
  EXPECT_EQ(after.y_mm, 83.5);
  EXPECT_NEAR((after.x_mm - before.x_mm) / (100 * kTick_s), 10 / std::sqrt(2.0), 1e-9);
}

TEST(Contact, ARobotPushedAgainstAWallHoldsThePusher) {
  const RunPlan plan = make_plan(kQuiet + "arena { width_mm: 200 height_mm: 200 } physics { robot_friction: 0.05 }",
                                 {{30, 0, 0}, {70, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  swarm.run(600);
  const auto poses = swarm.poses();
  EXPECT_NEAR(poses[1].x_mm, 83.5, 1e-9);
  EXPECT_LE(poses[1].x_mm, 83.5);
  EXPECT_NEAR(poses[0].x_mm, 50.5, 0.4);
}

TEST(Contact, MirroredScenesMirror) {
  const auto crowd = testing::random_crowd(60, 400, 400, 33.2, 5);
  auto mirrored = crowd;
  for (ScenePose& p : mirrored) p = {p.x_mm, -p.y_mm, -p.heading_rad};
  const std::string text = kQuiet + "arena { width_mm: 440 height_mm: 440 }";
  const RunPlan a = make_plan(text, crowd), b = make_plan(text, mirrored);
  Swarm first(a), second(b);
  for (int k = 0; k < 300; ++k) {
    for (std::uint32_t r = 0; r < 60; ++r) {
      const auto left = static_cast<std::uint8_t>((r + static_cast<std::uint32_t>(k) / 50) % 3 != 0 ? 70 : 0);
      const auto right = static_cast<std::uint8_t>((r + static_cast<std::uint32_t>(k) / 50) % 3 != 1 ? 70 : 0);
      first.set_motors(r, left, right);
      second.set_motors(r, right, left);
    }
    first.step();
    second.step();
  }
  const auto p = first.poses(), q = second.poses();
  for (std::size_t r = 0; r < 60; ++r) {
    EXPECT_NEAR(p[r].x_mm, q[r].x_mm, 1e-9);
    EXPECT_NEAR(p[r].y_mm, -q[r].y_mm, 1e-9);
    EXPECT_NEAR(std::remainder(p[r].heading_rad + q[r].heading_rad, 2 * kPi), 0, 1e-9);
  }
}

class Crowd : public ::testing::TestWithParam<int> {};

TEST_P(Crowd, DrivingInwardsForAMinuteNeverOverlaps) {
  const std::string text = "physics { sub_steps: " + std::to_string(GetParam()) + " }";
  const RunPlan plan = make_plan(text, testing::grid_crowd(1000, 40, testing::Facing::kInwards));
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  double largest = -1e300;
  for (int k = 0; k < 1831; ++k) {
    swarm.step();
    if (k % 30 == 0) largest = std::max(largest, largest_overlap_mm(swarm.poses()));
  }
  RecordProperty("largest_overlap_mm", std::to_string(largest));
  std::printf("largest overlap %.3g mm\n", largest);
  EXPECT_LE(largest, 1e-9);
  EXPECT_GE(largest, -0.01);  // They did touch.
}

INSTANTIATE_TEST_SUITE_P(SubSteps, Crowd, ::testing::Values(1, 2, 4));

TEST(Contact, NoRobotLeavesTheArena) {
  const auto crowd = testing::random_crowd(120, 460, 460, 33.1, 9);
  const RunPlan plan = make_plan("arena { width_mm: 500 height_mm: 500 }", crowd);
  Swarm swarm(plan);
  swarm.set_all_motors(255, 255);
  for (int k = 0; k < 1500; ++k) {
    if (k % 200 == 0) {
      for (std::uint32_t r = 0; r < 120; r += 3)
        swarm.set_motors(r, k % 400 == 0 ? 255 : 70, k % 400 == 0 ? 70 : 255);
    }
    swarm.step();
    for (const ScenePose& p : swarm.poses()) {
      ASSERT_LE(std::abs(p.x_mm), 250 - 16.5);
      ASSERT_LE(std::abs(p.y_mm), 250 - 16.5);
    }
  }
  EXPECT_LE(largest_overlap_mm(swarm.poses()), 1e-9);
}

TEST(Contact, OverlappingRobotsSeparateSmoothly) {
  auto crowd = testing::random_crowd(100, 300, 300, 5, 3);
  crowd[17] = crowd[42];  // two robots at the same position
  const RunPlan plan = make_plan(kQuiet, crowd);
  const physics::ContactLimits limits(plan, physics::DriveModel(plan));
  Swarm swarm(plan);
  auto before = swarm.poses();
  double overlap = largest_overlap_mm(before);
  for (int k = 0; k < 3000; ++k) {
    swarm.step();
    const auto now = swarm.poses();
    for (std::size_t r = 0; r < now.size(); ++r) {
      ASSERT_LE(std::hypot(now[r].x_mm - before[r].x_mm, now[r].y_mm - before[r].y_mm),
                limits.sub_steps * limits.stride_mm + 1e-9);
    }
    const double now_overlap = largest_overlap_mm(now);
    ASSERT_LE(now_overlap, overlap + 1e-9);
    overlap = now_overlap;
    before = now;
  }
  EXPECT_LE(overlap, 1e-6);
  for (const ScenePose& p : before) ASSERT_LE(std::abs(p.x_mm) + std::abs(p.y_mm), 1000);  // no explosion
}

TEST(Contact, ARobotOutsideTheArenaComesBack) {
  const RunPlan plan = make_plan(kQuiet + "arena { width_mm: 200 height_mm: 200 }", {{120, 0, 0}, {0, -110, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 70);
  swarm.run(200);
  EXPECT_EQ(swarm.poses()[0].x_mm, 83.5);
  EXPECT_EQ(swarm.poses()[1].y_mm, -83.5);
}

TEST(Contact, RestingCrowdsStayBitForBit) {
  const auto crowd = testing::grid_crowd(400, 33, testing::Facing::kRandom);
  const RunPlan plan = make_plan("", crowd);
  Swarm swarm(plan);
  swarm.run(50);
  const auto poses = swarm.poses();
  for (std::size_t r = 0; r < poses.size(); ++r) {
    EXPECT_EQ(poses[r].x_mm, crowd[r].x_mm);
    EXPECT_EQ(poses[r].y_mm, crowd[r].y_mm);
    EXPECT_EQ(poses[r].heading_rad, crowd[r].heading_rad);
  }
}

TEST(Contact, ATrackedRobotPushesAndIsNotPushed) {
  const std::string text = kQuiet + "robots { count: 1 } robots { count: 1 body: TRACKED }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}, {60, 0, 0}});
  Swarm swarm(plan);
  double x = 60;
  for (int k = 0; k < 300; ++k) {
    x -= 0.2;
    swarm.step({{1, x, 0, 0.5}});
  }
  EXPECT_EQ(swarm.poses()[1].x_mm, x);
  EXPECT_EQ(swarm.poses()[1].heading_rad, 0.5);
  swarm.run(100);
  EXPECT_EQ(swarm.poses()[1].x_mm, x);
  EXPECT_NEAR(swarm.poses()[0].x_mm, x - 33, 2e-9);
}

}  // namespace
}  // namespace kilotwin

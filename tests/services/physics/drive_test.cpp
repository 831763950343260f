// The differential drive against closed forms and against the distributions that it draws from.
#include "services/physics/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

using testing::kTick_s;
constexpr double kAxleOffset_mm = 9.2, kWheelBase_mm = 25;

ScenePose axle_of(const ScenePose& p) {
  return {p.x_mm - kAxleOffset_mm * std::cos(p.heading_rad), p.y_mm - kAxleOffset_mm * std::sin(p.heading_rad),
          p.heading_rad};
}

TEST(Drive, StraightRunsAtTenMillimetresPerSecond) {
  const RunPlan plan = make_plan("motion { noise: false }", {{-300, 17, 0.3}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  // 60 s are 1831.05 ticks.
  swarm.run(1831);
  const ScenePose pose = swarm.poses()[0];
  const double way_mm = std::hypot(pose.x_mm + 300, pose.y_mm - 17);
  EXPECT_NEAR(way_mm, 10 * 1831 * kTick_s, 600e-9);
  EXPECT_NEAR(way_mm * 60 / (1831 * kTick_s), 600, 600e-9);
  EXPECT_NEAR(std::atan2(pose.y_mm - 17, pose.x_mm + 300), 0.3, 1e-12);
  EXPECT_EQ(pose.heading_rad, 0.3);
}

TEST(Drive, DutyScalesSpeedUpToHalfMore) {
  for (const auto& [duty, ratio] :
       {std::pair{35, 0.5}, {70, 1.0}, {84, 1.2}, {105, 1.5}, {255, 1.5}, {1, 1.0 / 70}}) {
    const RunPlan plan = make_plan("motion { noise: false }", {{0, 0, 0}});
    Swarm swarm(plan);
    swarm.set_all_motors(static_cast<std::uint8_t>(duty), static_cast<std::uint8_t>(duty));
    swarm.run(100);
    EXPECT_NEAR(swarm.poses()[0].x_mm, 10 * ratio * 100 * kTick_s, 1e-9) << duty;
  }
}

TEST(Drive, CalibratedDutiesAreSeparateForStraightAndTurn) {
  const RunPlan plan = make_plan("motion { noise: false calibrated_straight_duty: 50 calibrated_turn_duty: 80 }",
                                 {{-500, 0, 0}, {0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 50, 50);
  swarm.set_motors(1, 80, 0);
  swarm.run(10);
  EXPECT_NEAR(swarm.poses()[0].x_mm, -500 + 100 * kTick_s, 1e-9);
  EXPECT_NEAR(swarm.poses()[1].heading_rad, 20 / kWheelBase_mm * 10 * kTick_s, 1e-12);
}

TEST(Drive, DutiesUpToTheDeadBandTurnNothing) {
  const RunPlan plan = make_plan("motion { dead_band_duty: 60 }", {{0, 0, 0}, {200, 0, 0}, {400, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 60, 60);
  swarm.set_motors(1, 61, 60);  // a turn: the other motor is in the dead band
  swarm.run(10);
  const auto poses = swarm.poses();
  EXPECT_EQ(poses[0].x_mm, 0);
  EXPECT_EQ(poses[0].heading_rad, 0);
  const physics::DriveModel drive(plan);
  const double right = 20 * 61.0 / 70 + drive.bias_right_mm_s(1), left = drive.bias_left_mm_s(1);
  EXPECT_NEAR(poses[1].heading_rad, (right - left) / kWheelBase_mm * 10 * kTick_s, 1e-12);
}

TEST(Drive, SlopeAndTopSpeedShapeTheCurve) {
  // 1 + 5 (d / 75 - 1) is Kilombo's line through its offset, (d - 60) / 15.
  for (const auto& [duty, ratio] :
       {std::pair{60, 0.0}, {68, 8.0 / 15}, {75, 1.0}, {82, 22.0 / 15}, {90, 2.0}, {255, 2.0}, {40, 0.0}}) {
    const RunPlan plan = make_plan(
        "motion { noise: false duty_slope: 5 top_speed_ratio: 2 calibrated_straight_duty: 75 }", {{0, 0, 0}});
    Swarm swarm(plan);
    swarm.set_all_motors(static_cast<std::uint8_t>(duty), static_cast<std::uint8_t>(duty));
    swarm.run(100);
    EXPECT_NEAR(swarm.poses()[0].x_mm, 10 * ratio * 100 * kTick_s, 1e-9) << duty;
  }
}

TEST(Drive, EachMotorHasItsRobotsOwnCalibration) {
  const std::string text =
      "motion { noise: false } "
      "robot_model { robot: 0 straight_left: 50 straight_right: 80 turn_left: 90 turn_right: 40 }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}, {0, 200, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 50, 80);
  swarm.set_motors(1, 70, 70);
  swarm.run(50);
  EXPECT_NEAR(swarm.poses()[0].x_mm, 500 * kTick_s, 1e-9);
  EXPECT_EQ(swarm.poses()[0].heading_rad, 0);
  EXPECT_NEAR(swarm.poses()[1].x_mm, 500 * kTick_s, 1e-9);
  swarm.set_motors(0, 90, 0);
  swarm.run(10);
  EXPECT_NEAR(swarm.poses()[0].heading_rad, 20 / kWheelBase_mm * 10 * kTick_s, 1e-12);
  swarm.set_motors(0, 0, 40);
  swarm.run(10);
  EXPECT_NEAR(swarm.poses()[0].heading_rad, 0, 1e-12);
  // The duty of another robot's left motor drives the right-hand wheel at 50 / 80 of the calibrated speed.
  swarm.set_motors(0, 40, 80);
  swarm.run(1);
  EXPECT_NEAR(swarm.poses()[0].heading_rad, -10 * (1 - 40.0 / 50) / kWheelBase_mm * kTick_s, 1e-12);
}

TEST(Drive, AKickIsFifteenMillisecondsAtFullDuty) {
  const std::string text = "motion { noise: false";
  const std::vector<ScenePose> start = {{0, 0, 0}, {0, 200, 0}, {0, 400, 0}};
  const RunPlan with = make_plan(text + " }", start), without = make_plan(text + " spin_up_s: 0 }", start);
  for (const RunPlan* plan : {&with, &without}) {
    const double kick_s = plan == &with ? 0.015 : 0;
    Swarm swarm(*plan);
    swarm.set_motors(0, 70, 70);
    swarm.set_motors(1, 70, 0);
    for (std::uint32_t robot = 0; robot < 3; ++robot) swarm.kick(robot);
    swarm.step();
    swarm.set_all_motors(0, 0);
    swarm.step();
    const auto poses = swarm.poses();
    EXPECT_NEAR(poses[0].x_mm, 15 * kick_s + 10 * (kTick_s - kick_s), 1e-12);
    EXPECT_NEAR(poses[1].heading_rad, 20 / kWheelBase_mm * (kTick_s - kick_s), 1e-13);
    EXPECT_NEAR(poses[2].x_mm, 15 * kick_s, 1e-12);  // no duties after the kick
    EXPECT_EQ(poses[2].heading_rad, 0);
  }
}

TEST(Drive, LeftMotorTurnsLeftAndFullTurnTakesTwoPiWheelBasesPerSpeed) {
  const RunPlan plan = make_plan("motion { noise: false }", {{0, 0, 0}, {300, 0, 0}});
  Swarm swarm(plan);
  swarm.set_motors(0, 70, 0);
  swarm.set_motors(1, 0, 70);
  const double turn_s = 2 * kPi * kWheelBase_mm / 20;
  EXPECT_NEAR(turn_s, 7.854, 5e-4);
  const auto ticks = static_cast<std::int64_t>(turn_s / kTick_s);
  swarm.run(ticks);
  const auto poses = swarm.poses();
  const double turned_rad = 20 / kWheelBase_mm * static_cast<double>(ticks) * kTick_s;
  EXPECT_NEAR(poses[0].heading_rad, turned_rad - 2 * kPi, 1e-9);
  EXPECT_NEAR(poses[1].heading_rad, 2 * kPi - turned_rad, 1e-9);
  // The rest of the time covers the remaining turn at this rate.
  EXPECT_NEAR(static_cast<double>(ticks) * kTick_s - poses[0].heading_rad / 0.8, turn_s, 1e-9);
}

TEST(Drive, PivotingDiscCentreMovesOnACircleAroundTheStandingLeg) {
  const RunPlan plan = make_plan("motion { noise: false }", {{50, -20, 1.1}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 0);
  const ScenePose start = axle_of({50, -20, 1.1});
  const double leg_x = start.x_mm - kWheelBase_mm / 2 * std::sin(1.1),
               leg_y = start.y_mm + kWheelBase_mm / 2 * std::cos(1.1);
  const double radius_mm = std::hypot(kWheelBase_mm / 2, kAxleOffset_mm);
  for (int k = 0; k < 300; ++k) {
    swarm.step();
    const ScenePose pose = swarm.poses()[0];
    ASSERT_NEAR(std::hypot(pose.x_mm - leg_x, pose.y_mm - leg_y), radius_mm, 1e-10);
  }
}

TEST(Drive, ArcOfABiasedRobotIsTheExactCircle) {
  const double left_mm_s = 10 - 1.5, right_mm_s = 10 + 2.25;
  const RunPlan plan = make_plan(
      "robot_model { robot: 0 bias_left_mm_s: -1.5 bias_right_mm_s: 2.25 } duration_s: 60", {{10, 20, -2.0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  const ScenePose axle = axle_of({10, 20, -2.0});
  const double rate = (right_mm_s - left_mm_s) / kWheelBase_mm, radius_mm = (left_mm_s + right_mm_s) / 2 / rate;
  for (int k = 1; k <= 1831; ++k) {
    swarm.step();
    const double heading = -2.0 + rate * k * kTick_s;
    const double x =
        axle.x_mm + radius_mm * (std::sin(heading) - std::sin(-2.0)) + kAxleOffset_mm * std::cos(heading);
    const double y =
        axle.y_mm - radius_mm * (std::cos(heading) - std::cos(-2.0)) + kAxleOffset_mm * std::sin(heading);
    const ScenePose pose = swarm.poses()[0];
    ASSERT_NEAR(pose.x_mm, x, 1e-9);
    ASSERT_NEAR(pose.y_mm, y, 1e-9);
    ASSERT_NEAR(std::remainder(pose.heading_rad - heading, 2 * kPi), 0, 1e-11);
  }
}

TEST(Drive, LargeTurnsPerTickFollowTheSameCircle) {
  // 2^20 cycles and fast wheels: 3.15 rad per tick, beyond the series.
  const std::string text = "tick_cycles: 1048576 motion { noise: false turn_speed_mm_s: 600 }";
  const RunPlan plan = make_plan(text, {{0, 0, 0}});
  Swarm swarm(plan);
  swarm.set_all_motors(70, 0);
  swarm.step();
  const double turn = 600 / kWheelBase_mm * 0.131072;
  const ScenePose pose = swarm.poses()[0];
  EXPECT_NEAR(pose.x_mm, -kAxleOffset_mm + 12.5 * std::sin(turn) + kAxleOffset_mm * std::cos(turn), 1e-11);
  EXPECT_NEAR(pose.y_mm, 12.5 - 12.5 * std::cos(turn) + kAxleOffset_mm * std::sin(turn), 1e-11);
  EXPECT_NEAR(pose.heading_rad, turn - 2 * kPi, 1e-12);
}

TEST(Drive, SeriesAndLargeFormAgreeAtTheirBorder) {
  for (const double sign : {-1.0, 1.0}) {
    const physics::Arc below = physics::arc_of(3, sign * 0.125, 9.2),
                       above = physics::arc_of(3, sign * 0.12500000000000003, 9.2);
    EXPECT_NEAR(below.forward_mm, above.forward_mm, 2e-14);
    EXPECT_NEAR(below.sideways_mm, above.sideways_mm, 2e-14);
    EXPECT_NEAR(below.cos_turn, std::cos(sign * 0.125), 2e-16);
    EXPECT_NEAR(below.sin_turn, std::sin(sign * 0.125), 2e-16);
  }
}

TEST(Drive, BiasActsOnBothWheelsWhileEitherIsDrivenAndOnNoneAtStop) {
  const std::string model = "robot_model { robot: 0 bias_left_mm_s: 1 bias_right_mm_s: 1 }";
  const RunPlan plan = make_plan(model, {{0, 0, 0}});
  Swarm turning(plan), resting(plan);
  turning.set_all_motors(70, 0);
  turning.step();
  EXPECT_NEAR(turning.poses()[0].heading_rad, 20 / kWheelBase_mm * kTick_s,
              1e-14);  // 21 - 1: the wheel at rest still has its bias
  resting.run(100);
  EXPECT_EQ(resting.poses()[0].x_mm, 0);
  EXPECT_EQ(resting.poses()[0].heading_rad, 0);
}

TEST(Drive, NoiseOffSilencesTheStatedBias) {
  const RunPlan plan = make_plan("motion { noise: false } robot_model { robot: 0 bias_left_mm_s: 5 }", {{0, 0, 0}});
  const physics::DriveModel drive(plan);
  EXPECT_EQ(drive.bias_left_mm_s(0), 0);
}

TEST(Drive, AHalfStatedBiasKeepsTheDrawOfTheOtherWheel) {
  const RunPlan plain = make_plan("", {{0, 0, 0}}),
                stated = make_plan("robot_model { robot: 0 bias_left_mm_s: 0.5 }", {{0, 0, 0}});
  const physics::DriveModel a(plain), b(stated);
  EXPECT_EQ(b.bias_left_mm_s(0), 0.5);
  EXPECT_EQ(b.bias_right_mm_s(0), a.bias_right_mm_s(0));
}

TEST(Drive, BiasesFollowTheDistributionOfTheArgosPaper) {
  constexpr std::uint32_t kRobots = 20000;
  const RunPlan plan = make_plan("arena { width_mm: 100000 height_mm: 100000 }",
                                 testing::grid_crowd(kRobots, 100, testing::Facing::kRight));
  const physics::DriveModel drive(plan);
  double sum = 0, square = 0, product = 0;
  int within_one_sd = 0;
  for (std::uint32_t r = 0; r < kRobots; ++r) {
    const double left = (drive.bias_left_mm_s(r) - 0.015) / 1.86, right = (drive.bias_right_mm_s(r) - 0.015) / 1.86;
    sum += left + right;
    square += left * left + right * right;
    product += left * right;
    within_one_sd += (std::abs(left) < 1) + (std::abs(right) < 1);
  }
  // Each bound is 4.4 standard errors: a correct generator fails one of the four with probability 5e-5; the seed is fixed.
  constexpr double n = 2 * kRobots;
  EXPECT_NEAR(sum / n, 0, 4.4 / std::sqrt(n));
  EXPECT_NEAR(square / n, 1, 4.4 * std::sqrt(2 / n));
  EXPECT_NEAR(product / kRobots, 0, 4.4 / std::sqrt(kRobots));
  EXPECT_NEAR(within_one_sd / n, 0.682689, 4.4 * std::sqrt(0.682689 * 0.317311 / n));
}

// Variance of the displacement after 4.194304 s for a tick length, mm^2.
double way_variance(std::uint32_t tick_cycles, double variance_s) {
  constexpr std::uint32_t kRobots = 4000;
  const std::string text = "tick_cycles: " + std::to_string(tick_cycles) +
                           " arena { width_mm: 100000 height_mm: 100000 } motion { bias_mean_mm_s: 0 bias_sd_mm_s: "
                           "0 factor_variance_s: " +
                           std::to_string(variance_s) + " }";
  const auto start = testing::grid_crowd(kRobots, 200, testing::Facing::kRight);
  const RunPlan plan = make_plan(text, start);
  Swarm swarm(plan);
  swarm.set_all_motors(70, 70);
  swarm.run(static_cast<std::int64_t>(1u << 25) / tick_cycles);
  const auto end = swarm.poses();
  double sum = 0, square = 0;
  for (std::uint32_t r = 0; r < kRobots; ++r) {
    const double excess = end[r].x_mm - start[r].x_mm - 10 * 4.194304;
    sum += excess;
    square += excess * excess;
  }
  return square / kRobots - sum / kRobots * sum / kRobots;
}

TEST(Drive, StepNoiseVarianceDoesNotDependOnTheTickLength) {
  // Each wheel's travel has the variance v^2 q t; their mean has half of it. q is small, so the turn does not shorten the path.
  const double q = 2e-5, expected = 100 * q * 4.194304 / 2;
  // The relative standard error of a variance of 4000 samples is 2.24 %; the bound is 4.4 of them.
  for (const std::uint32_t cycles : {1u << 16, 1u << 18, 1u << 20}) {
    EXPECT_NEAR(way_variance(cycles, q) / expected, 1, 4.4 * 0.0224) << cycles;
  }
}

TEST(Drive, NoRobotExceedsTheTopSpeed) {
  const auto start = testing::grid_crowd(500, 300, testing::Facing::kRandom);
  const RunPlan plan =
      make_plan("arena { width_mm: 100000 height_mm: 100000 } motion { factor_variance_s: 0.01 }", start);
  const physics::DriveModel drive(plan);
  Swarm swarm(plan);
  auto before = start;
  double fastest = 0;
  for (int k = 0; k < 100; ++k) {
    for (std::uint32_t r = 0; r < 500; ++r) swarm.set_motors(r, k % 3 == 0 ? 0 : 255, k % 3 == 1 ? 0 : 255);
    swarm.step();
    const auto now = swarm.poses();
    for (std::size_t r = 0; r < 500; ++r) {
      const double way_mm = std::hypot(now[r].x_mm - before[r].x_mm, now[r].y_mm - before[r].y_mm);
      fastest = std::max(fastest, way_mm / kTick_s);
    }
    before = now;
  }
  EXPECT_LT(fastest, drive.top_speed_mm_s());
  EXPECT_GT(fastest, 0.2 * drive.top_speed_mm_s());
}

}  // namespace
}  // namespace kilotwin

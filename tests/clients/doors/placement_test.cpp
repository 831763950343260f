#include "clients/doors/placement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/base/pose.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

constexpr double kUpright = 0.5;  // rad, limit of the tilt
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// The rotation by an angle about an axis of length 1.
SourcePose turned(double angle_rad, double ax, double ay, double az) {
  const double s = std::sin(angle_rad / 2);
  return {0, 0, 0, s * ax, s * ay, s * az, std::cos(angle_rad / 2)};
}

TEST(Placement, APoseOfRosIsMetresWithXForwardAndYLeft) {
  const Placement placement(settings("ros2 {}"));
  SourcePose pose = turned(0.3, 0, 0, 1);
  pose.x = 0.25, pose.y = -0.5, pose.z = 0.03;
  TrackedRobot robot;
  ASSERT_EQ(placement.place(pose, kUpright, robot), Fault::kNone);
  EXPECT_DOUBLE_EQ(robot.x_mm, 250);
  EXPECT_DOUBLE_EQ(robot.y_mm, -500);
  EXPECT_NEAR(robot.heading_rad, 0.3, 1e-12);
  EXPECT_FLOAT_EQ(robot.xx_mm2, 1);
  EXPECT_FLOAT_EQ(robot.heading_variance_rad2, static_cast<float>(std::pow(5 * kPi / 180, 2)));
}

TEST(Placement, FromTheArenaAndBackIsTheSamePose) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-1000, 1000), angle(-kPi, kPi), unit(0.1, 2000);
  for (const char* up : {"Z_UP", "Y_UP", "PICTURE"}) {
    for (int i = 0; i < 300; ++i) {
      const Placement placement(settings("ros2 {} placement { x_mm: " + std::to_string(place(random)) +
                                         " y_mm: " + std::to_string(place(random)) +
                                         " turn_deg: " + std::to_string(angle(random) * 50) +
                                         " unit_mm: " + std::to_string(unit(random)) + " up: " + up + " }"));
      const double x = place(random), y = place(random), heading = angle(random);
      const SourcePose source = placement.from_arena(x, y, heading);
      TrackedRobot robot;
      ASSERT_EQ(placement.place(source, 1e-6, robot), Fault::kNone) << up;
      EXPECT_NEAR(robot.x_mm, x, 1e-8) << up;
      EXPECT_NEAR(robot.y_mm, y, 1e-8) << up;
      EXPECT_NEAR(std::remainder(robot.heading_rad - heading, 2 * kPi), 0, 1e-9) << up;
    }
  }
}

TEST(Placement, LengthsAndAnglesBetweenPointsArePreserved) {
  const Placement placement(settings("ros2 {} placement { x_mm: 7 y_mm: -3 turn_deg: 33 unit_mm: 10 up: Y_UP }"));
  TrackedRobot a, b;
  ASSERT_EQ(placement.place({1, 9, 2}, kUpright, a), Fault::kNone);
  ASSERT_EQ(placement.place({4, -5, 6}, kUpright, b), Fault::kNone);
  EXPECT_NEAR(std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm), 50, 1e-9) << "the height does not count";
}

TEST(Placement, YIsUpForMotive) {
  const Placement placement(settings("ros2 {} placement { up: Y_UP }"));
  SourcePose pose = turned(0.4, 0, 1, 0);  // about the vertical, anticlockwise seen from above
  pose.x = 1, pose.y = 0.03, pose.z = 2;
  TrackedRobot robot;
  ASSERT_EQ(placement.place(pose, kUpright, robot), Fault::kNone);
  EXPECT_DOUBLE_EQ(robot.x_mm, 1000);
  EXPECT_DOUBLE_EQ(robot.y_mm, -2000);
  EXPECT_NEAR(robot.heading_rad, 0.4, 1e-12);
}

TEST(Placement, ArkPixelsCountFromTheTopLeft) {
  const Placement placement(settings("ark {}"));
  TrackedRobot robot;
  ASSERT_EQ(placement.place_point(1000, 1000, robot), Fault::kNone);
  EXPECT_DOUBLE_EQ(robot.x_mm, 0);
  EXPECT_DOUBLE_EQ(robot.y_mm, 0);
  ASSERT_EQ(placement.place_point(0, 0, robot), Fault::kNone);
  EXPECT_DOUBLE_EQ(robot.x_mm, -1000);
  EXPECT_DOUBLE_EQ(robot.y_mm, 1000);
  EXPECT_NEAR(placement.heading_of(0, -3), kPi / 2, 1e-12) << "upwards in the picture";
}

TEST(Placement, HeadingAddsTurnAndOffset) {
  const Placement placement(settings("ros2 {} placement { turn_deg: 90 heading_offset_deg: -30 }"));
  TrackedRobot robot;
  ASSERT_EQ(placement.place(turned(kPi, 0, 0, 1), kUpright, robot), Fault::kNone);
  EXPECT_NEAR(std::remainder(robot.heading_rad - (kPi + kPi / 3), 2 * kPi), 0, 1e-12);
  EXPECT_GE(robot.heading_rad, -kPi);
  EXPECT_LT(robot.heading_rad, kPi);
}

TEST(Placement, ABodyThatLeansTooMuchIsRefused) {
  const Placement placement(settings("ros2 {}"));
  TrackedRobot robot;
  for (const double direction : {0.0, 1.0, 2.5, -3.0}) {
    const double ax = std::cos(direction), ay = std::sin(direction);
    EXPECT_EQ(placement.place(turned(kUpright - 0.01, ax, ay, 0), kUpright, robot), Fault::kNone);
    EXPECT_EQ(placement.place(turned(kUpright + 0.01, ax, ay, 0), kUpright, robot), Fault::kTilted);
    EXPECT_EQ(placement.place(turned(kPi, ax, ay, 0), kPi, robot), Fault::kNone) << "180 degrees refuse nothing";
  }
}

TEST(Placement, YawSurvivesALean) {
  // A lean about the body's own x axis turns nothing on the floor.
  const Placement placement(settings("ros2 {}"));
  const double yaw = 1.1, lean = 0.3;
  const double cy = std::cos(yaw / 2), sy = std::sin(yaw / 2), cl = std::cos(lean / 2), sl = std::sin(lean / 2);
  TrackedRobot robot;
  ASSERT_EQ(placement.place({0, 0, 0, cy * sl, sy * sl, sy * cl, cy * cl}, kUpright, robot), Fault::kNone);
  EXPECT_NEAR(robot.heading_rad, yaw, 1e-12);
}

TEST(Placement, WithoutARotationTheHeadingIsNotKnown) {
  const Placement placement(settings("ros2 {}"));
  TrackedRobot robot;
  ASSERT_EQ(placement.place({1, 2, 0, 0, 0, 0, 0}, kUpright, robot), Fault::kNone);
  EXPECT_TRUE(std::isinf(robot.heading_variance_rad2));
  ASSERT_EQ(placement.place(turned(kPi / 2, 0, 1, 0), kPi, robot), Fault::kNone);
  EXPECT_TRUE(std::isinf(robot.heading_variance_rad2)) << "its x axis is vertical";
}

TEST(Placement, RefusesAllButPoses) {
  const Placement placement(settings("ros2 {}"));
  TrackedRobot robot;
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNan, inf, -inf}) {
    EXPECT_EQ(placement.place({bad, 0, 0}, kUpright, robot), Fault::kNotFinite);
    EXPECT_EQ(placement.place({0, 0, bad}, kUpright, robot), Fault::kNotFinite);
    EXPECT_EQ(placement.place({0, 0, 0, 0, 0, 0, bad}, kUpright, robot), Fault::kNotFinite);
  }
  EXPECT_EQ(placement.place({1e308, 1e308, 0}, kUpright, robot), Fault::kNotFinite) << "in mm it is";
  EXPECT_EQ(placement.place({0, 0, 0, 0, 0, 0.5, 0.5}, kUpright, robot), Fault::kQuaternion);
}

TEST(Placement, CovarianceTurnsWithTheAxes) {
  const Placement placement(settings("ros2 {} placement { turn_deg: 90 }"));
  TrackedRobot robot;
  ASSERT_EQ(placement.place({}, kUpright, robot), Fault::kNone);
  SourceCovariance covariance;
  covariance.xx = 4e-6, covariance.yy = 1e-6, covariance.about_z = 0.01;
  placement.spread(covariance, robot);
  EXPECT_NEAR(robot.xx_mm2, 1, 1e-5);
  EXPECT_NEAR(robot.yy_mm2, 4, 1e-5);
  EXPECT_NEAR(robot.xy_mm2, 0, 1e-5);
  EXPECT_FLOAT_EQ(robot.heading_variance_rad2, 0.01f);
}

TEST(Placement, TraceAndDeterminantOfTheCovarianceDoNotDependOnTheTurn) {
  for (const double turn : {10.0, 45.0, 133.0, -170.0}) {
    for (const char* up : {"Z_UP", "Y_UP", "PICTURE"}) {
      const Placement placement(
          settings("ros2 {} placement { unit_mm: 1 turn_deg: " + std::to_string(turn) + " up: " + up + " }"));
      TrackedRobot robot;
      ASSERT_EQ(placement.place({}, kUpright, robot), Fault::kNone);
      placement.spread({5, 2, 2, 3, 3, 0, 0}, robot);
      EXPECT_NEAR(robot.xx_mm2 + robot.yy_mm2, 8, 1e-5);
      EXPECT_NEAR(robot.xx_mm2 * robot.yy_mm2 - robot.xy_mm2 * robot.xy_mm2, 11, 1e-4);
    }
  }
}

TEST(Placement, ACovarianceOfZerosIsNotKnown) {
  const Placement placement(settings("ros2 {} position_sd_mm: 3"));
  TrackedRobot robot;
  ASSERT_EQ(placement.place({}, kUpright, robot), Fault::kNone);
  for (const SourceCovariance& bad : {SourceCovariance{}, SourceCovariance{kNan, 0, 0, 1, 1, kNan, kNan},
                                      SourceCovariance{1, 5, 0, 1, 1, 0, -1}}) {
    placement.spread(bad, robot);
    EXPECT_FLOAT_EQ(robot.xx_mm2, 9);
    EXPECT_FLOAT_EQ(robot.yy_mm2, 9);
    EXPECT_FLOAT_EQ(robot.heading_variance_rad2, static_cast<float>(std::pow(5 * kPi / 180, 2)));
  }
}

}  // namespace
}  // namespace kilotwin::doors::test

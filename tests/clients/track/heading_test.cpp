// The heading filter against robots that drive by the exact kinematics, with the biases of the ARGoS paper.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "clients/track/heading_filter.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

constexpr double kWheelBase_mm = 25, kAhead_mm = 9.2;

/// The kinematics of docs/explanation/motion.md, integrated in small steps.
struct Robot {
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  void drive(double left_mm_s, double right_mm_s, double dt_s) {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      const double speed = 0.5 * (left_mm_s + right_mm_s), h = dt_s / kSteps;
      heading_rad += (right_mm_s - left_mm_s) / kWheelBase_mm * h / 2;
      x_mm += speed * std::cos(heading_rad) * h;
      y_mm += speed * std::sin(heading_rad) * h;
      heading_rad += (right_mm_s - left_mm_s) / kWheelBase_mm * h / 2;
    }
  }
  [[nodiscard]] double centre_x() const { return x_mm + kAhead_mm * std::cos(heading_rad); }
  [[nodiscard]] double centre_y() const { return y_mm + kAhead_mm * std::sin(heading_rad); }
};

TEST(Headings, PivotsAreNotTakenForTheDirectionOfMotion) {
  // About the left leg the centre's velocity is atan(a w / v) = 36.3 degrees off the heading.
  for (const double side : {-1.0, 1.0}) {
    Robot robot;
    HeadingFilter filter;
    constexpr double kStep_s = 1.0 / 30;
    for (int i = 0; i < 90; ++i) {
      robot.drive(side > 0 ? 0 : 20, side > 0 ? 20 : 0, kStep_s);
      filter.update(i * kStep_s, robot.centre_x(), robot.centre_y(), 0.1);
    }
    ASSERT_TRUE(filter.heading());
    EXPECT_NEAR(wrapped(filter.heading()->heading_rad - robot.heading_rad), 0, 0.05);
    EXPECT_GT(filter.modes()[side > 0 ? 2 : 3], 0.9);
  }
}

TEST(Headings, IsUnknownWhileTheRobotRests) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.2);
  HeadingFilter filter;
  for (int i = 0; i < 3000; ++i) filter.update(i / 30.0, noise(random), noise(random), 0.2);
  EXPECT_FALSE(filter.heading());
}

TEST(Headings, ALedReadingGivesItAtRest) {
  HeadingFilter filter;
  for (int i = 0; i < 30; ++i) filter.update(i / 30.0, 5, 5, 0.1, 2.0, 0.1);
  ASSERT_TRUE(filter.heading());
  EXPECT_NEAR(filter.heading()->heading_rad, 2.0, 0.02);
}

struct TurnCondition {
  double sd_mm, step_s;
  double half_mm = 1e9;  ///< half the side of the arena: its walls hold discs, and do not turn them
  bool led = false;      ///< the LED gives the heading, too
};

/// The wall pushes the robot back. True where it did.
bool held(Robot& robot, double half_mm) {
  const double x = robot.centre_x(), y = robot.centre_y();
  const double dx = std::clamp(x, -half_mm, half_mm) - x, dy = std::clamp(y, -half_mm, half_mm) - y;
  robot.x_mm += dx;
  robot.y_mm += dy;
  return dx != 0 || dy != 0;
}

class HeadingOf : public testing::TestWithParam<TurnCondition> {};

TEST_P(HeadingOf, IsWithinFiveDegreesAfterStraightMotionAndTenOverall) {
  const auto [sd_mm, step_s, half_mm, led] = GetParam();
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double all = 0, straight = 0, normalised = 0;
  int count = 0, straight_count = 0;
  constexpr int kRobots = 60;
  for (int i = 0; i < kRobots; ++i) {
    const double bias_left = 1.86 * normal(random), bias_right = 1.86 * normal(random);
    Robot robot;
    robot.heading_rad = 2 * std::numbers::pi * uniform(random);
    HeadingFilter filter;
    int mode = 1;
    double until_s = 0, since_s = 0, held_s = -10;
    for (double t = 0; t < 40; t += step_s) {
      if (t >= until_s) {
        since_s = t;
        mode = static_cast<int>(4 * uniform(random));
        until_s = t + 1 + 6 * uniform(random);
      }
      const double left = mode == 0 ? 0 : (mode == 1 ? 10 : mode == 2 ? 0 : 20) + bias_left;
      const double right = mode == 0 ? 0 : (mode == 1 ? 10 : mode == 2 ? 20 : 0) + bias_right;
      robot.drive(left, right, step_s);
      if (held(robot, half_mm)) held_s = t;
      const double x = robot.centre_x() + sd_mm * normal(random), y = robot.centre_y() + sd_mm * normal(random);
      constexpr double kLed_rad = 0.1;
      if (led)
        filter.update(t, x, y, sd_mm, wrapped(robot.heading_rad + kLed_rad * normal(random)), 2 * kLed_rad);
      else
        filter.update(t, x, y, sd_mm);
      const std::optional<Heading> heading = filter.heading();
      if (!heading) continue;
      const double error = wrapped(heading->heading_rad - robot.heading_rad);
      all += error * error;
      normalised += error * error / heading->variance_rad2;
      ++count;
      if (mode != 1 || t - since_s < 2 || t - held_s < 2) continue;
      straight += error * error;
      ++straight_count;
    }
  }
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double all_deg = kDegrees * std::sqrt(all / count);
  const double straight_deg = kDegrees * std::sqrt(straight / straight_count);
  RecordProperty("overall_deg", std::to_string(all_deg));
  RecordProperty("straight_deg", std::to_string(straight_deg));
  EXPECT_LT(all_deg, 10);
  EXPECT_LT(straight_deg, 5);
  // The stated variance is of the size of the errors.
  EXPECT_LT(normalised / count, 3);
  EXPECT_GT(normalised / count, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Conditions, HeadingOf,
                         testing::Values(TurnCondition{0.1, 1 / 30.0}, TurnCondition{0.3, 1 / 30.0},
                                         TurnCondition{0.3, 0.1}, TurnCondition{0.6, 1 / 30.0},
                                         TurnCondition{0.1, 1 / 30.0, 150, true},
                                         TurnCondition{0.3, 1 / 30.0, 150, true}));

/// Robots that others push jump by many times the stated error. No hypothesis may run away: wrapped() would not return.
TEST(Headings, StayBoundedWherePositionsJump) {
  constexpr double kStep_s = 0.1, kStated_mm = 0.02, kJump_mm = 0.6;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0, 1);
    Robot robot;
    HeadingFilter filter;
    for (int i = 0; i < 6000; ++i) {
      const int turn = static_cast<int>(random() % 4);
      robot.drive(turn == 1 ? 0 : 10, turn == 2 ? 0 : 10, kStep_s);
      const double jump_mm = i % 37 == 0 ? kJump_mm : kStated_mm;
      const double x = robot.centre_x() + jump_mm * noise(random),
                   y = robot.centre_y() + kStated_mm * noise(random);
      const bool lit = i / 100 % 3 != 0;
      const double seen = wrapped(std::remainder(robot.heading_rad, 2 * kPi) + 0.1 * noise(random));
      if (lit)
        filter.update(i * kStep_s, x, y, kStated_mm, seen, 0.1);
      else
        filter.update(i * kStep_s, x, y, kStated_mm);
    }
    ASSERT_TRUE(filter.heading());
    EXPECT_LT(std::abs(std::remainder(filter.heading()->heading_rad - robot.heading_rad, 2 * kPi)), 0.3) << seed;
  }
}

/// Only seen headings can speak for the hypothesis of a robot that turns in place. Without them it has no weight. As soon as the LED
/// is seen again, the hypothesis must begin anew where the robot is.
TEST(Headings, OfARobotThatTurnsInPlaceAreSeenAfterAnHourInTheDark) {
  constexpr double kStep_s = 0.1, kLit_s = 20, kDark_s = 3600;
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0, 1);
  Robot robot;
  HeadingFilter filter;
  for (int i = 0; i * kStep_s < kDark_s + 2 * kLit_s; ++i) {
    const double t = i * kStep_s;
    const int turn = i / 50 % 4;  // straight, left, straight, right, 5 s each
    robot.drive(turn == 1 ? 0 : 10, turn == 3 ? 0 : 10, kStep_s);
    const double x = robot.centre_x() + 0.1 * noise(random), y = robot.centre_y() + 0.1 * noise(random);
    if (t < kLit_s || t > kLit_s + kDark_s)
      filter.update(t, x, y, 0.1, wrapped(std::remainder(robot.heading_rad, 2 * kPi) + 0.1 * noise(random)), 0.1);
    else
      filter.update(t, x, y, 0.1);
  }
  ASSERT_TRUE(filter.heading());
  EXPECT_NEAR(std::remainder(filter.heading()->heading_rad - robot.heading_rad, 2 * kPi), 0, 0.15);
  EXPECT_LT(filter.heading()->variance_rad2, 0.05);
  // Something holds it.
  constexpr double kHeld_s = 8, kTurn_rad_s = 0.6;
  const double x = robot.centre_x(), y = robot.centre_y();
  for (int i = 1; i * kStep_s < kHeld_s; ++i) {
    robot.heading_rad += kTurn_rad_s * kStep_s;
    filter.update(kDark_s + 2 * kLit_s + i * kStep_s, x + 0.1 * noise(random), y + 0.1 * noise(random), 0.1,
                  wrapped(std::remainder(robot.heading_rad, 2 * kPi) + 0.1 * noise(random)), 0.1);
  }
  EXPECT_GT(filter.modes()[HeadingFilter::kTurned], 0.5);
  EXPECT_NEAR(std::remainder(filter.heading()->heading_rad - robot.heading_rad, 2 * kPi), 0, 0.15);
}

TEST(Headings, OfARobotThatAWallHoldsAreUncertain) {
  // It drives at 60 degrees against a wall and slides along it: the path is straight, and is not its heading.
  Robot robot;
  robot.heading_rad = kPi / 3;
  robot.y_mm = -60;
  HeadingFilter filter;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.1);
  constexpr double kStep_s = 1.0 / 30;
  double t = 0, slides_since_s = 1e9, worst = 0;
  for (; t < 25; t += kStep_s) {
    robot.drive(10, 10, kStep_s);
    const double beyond_mm = robot.centre_y();
    if (beyond_mm > 0) {
      robot.y_mm -= beyond_mm;
      slides_since_s = std::min(slides_since_s, t);
    }
    filter.update(t, robot.centre_x() + noise(random), robot.centre_y() + noise(random), 0.1);
    if (t < slides_since_s + 1) continue;
    const double error = wrapped(filter.heading()->heading_rad - robot.heading_rad);
    worst = std::max(worst, error * error / filter.heading()->variance_rad2);
  }
  EXPECT_LT(slides_since_s, 15);
  EXPECT_LT(worst, 9) << "errors within three standard deviations";
  // It turns away, and is known again.
  for (const double end_s = t + 6; t < end_s; t += kStep_s) {
    const bool turns = t < end_s - 4;
    robot.drive(turns ? 20 : 10, turns ? 0 : 10, kStep_s);
    filter.update(t, robot.centre_x() + noise(random), robot.centre_y() + noise(random), 0.1);
  }
  EXPECT_NEAR(wrapped(filter.heading()->heading_rad - robot.heading_rad), 0, 0.09);
}

}  // namespace
}  // namespace kilotwin::track

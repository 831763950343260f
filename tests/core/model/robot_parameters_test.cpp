// Per-robot parameters: stated, default or drawn at random.
#include "core/model/robot_parameters.hpp"

#include <gtest/gtest.h>

#include "tests/support/scenes.hpp"

namespace kilotwin {
namespace {

using testing::make_plan;

const std::vector<testing::ScenePose> kThree = {{0, 0, 0}, {100, 0, 0}, {200, 0, 0}};

TEST(RobotParameters, AreTheDefaultsUnlessStated) {
  const RunPlan plan = make_plan(
      "motion { calibrated_straight_duty: 66 calibrated_turn_duty: 77 } "
      "robot_model { robot: 1 turn_left: 60 straight_right: 81 } robot_model { robot: 99 turn_left: 3 }",
      kThree);
  const RobotParameters parameters(plan);
  ASSERT_EQ(parameters.robots(), 3u);
  EXPECT_EQ(parameters.calibration(0), (Calibration{77, 77, 66, 66}));
  EXPECT_EQ(parameters.calibration(1), (Calibration{60, 77, 66, 81}));
  EXPECT_EQ(parameters.calibration(2), (Calibration{77, 77, 66, 66}));
}

TEST(RobotParameters, BiasesDependOnSeedAndRobotOnly) {
  const RunPlan plan = make_plan("seed: 5", kThree), silent = make_plan("seed: 5 motion { noise: false }", kThree),
                other = make_plan("seed: 6", kThree),
                longer = make_plan("seed: 5 duration_s: 3 robot_model { robot: 2 bias_left_mm_s: 4 }", kThree);
  const RobotParameters a(plan), b(silent), c(other), d(longer);
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    EXPECT_NE(a.bias(robot).left_mm_s, 0);
    EXPECT_EQ(a.bias(robot).left_mm_s, b.bias(robot).left_mm_s);
    EXPECT_NE(a.bias(robot).left_mm_s, c.bias(robot).left_mm_s);
    EXPECT_EQ(a.bias(robot).right_mm_s, d.bias(robot).right_mm_s);
    EXPECT_EQ(d.bias(robot).left_mm_s, robot == 2 ? 4 : a.bias(robot).left_mm_s);
  }
}

TEST(RobotParameters, RealRobotsHaveNoDrawnBias) {
  const RunPlan plan = make_plan("robots { count: 2 } robots { count: 1 body: TRACKED }", kThree);
  EXPECT_NE(RobotParameters(plan).bias(1).left_mm_s, 0);
  EXPECT_EQ(RobotParameters(plan).bias(2).left_mm_s, 0);
}

}  // namespace
}  // namespace kilotwin

// Detection of drawn discs with known centres: recall, precision and error of the centre.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>

#include "clients/track/brightness.hpp"
#include "clients/track/detect.hpp"
#include "tests/clients/track/drawn_scene.hpp"

namespace kilotwin::track {
namespace {

struct DiscCondition {
  const char* name;
  double radius_px, noise, uneven;
  bool touching;
  int clutter;
  double recall;       ///< demanded
  int wrong;           ///< allowed
  double error_radii;  ///< root mean square of the centre's error, in radii
};

std::ostream& operator<<(std::ostream& out, const DiscCondition& c) {
  return out << c.name << " radius " << c.radius_px;
}

class Detect : public testing::TestWithParam<DiscCondition> {};

TEST_P(Detect, FindsTheDiscs) {
  const DiscCondition& c = GetParam();
  DrawnScene scene;
  const double zoom = c.radius_px < 12 ? 1 : c.radius_px < 30 ? 1.6 : 2.6;
  scene.width_px = cvRound(560 * zoom);
  scene.height_px = cvRound(420 * zoom);
  scene.noise = c.noise;
  scene.uneven = c.uneven;
  scene.clutter = c.clutter;
  scene.blur_px = 0.7 * std::max(1.0, c.radius_px / 20);
  scene.robots = scatter(scene, c.radius_px > 30 ? 18 : 35, c.radius_px, c.touching);
  Detector detector;
  const std::vector<Detection> found = detector.find(grey_of(draw(scene)));
  int hits = 0;
  double squares = 0;
  for (const DrawnRobot& robot : scene.robots) {
    for (const Detection& detection : found) {
      const double off = std::hypot(detection.disc.centre.x_px - robot.disc.centre.x_px,
                                    detection.disc.centre.y_px - robot.disc.centre.y_px);
      if (off > 0.3 * c.radius_px) continue;
      ++hits;
      squares += off * off;
      break;
    }
  }
  EXPECT_GE(hits, c.recall * static_cast<double>(scene.robots.size()));
  EXPECT_LE(static_cast<int>(found.size()) - hits, c.wrong);
  EXPECT_LT(std::sqrt(squares / std::max(1, hits)), c.error_radii * c.radius_px);
}

INSTANTIATE_TEST_SUITE_P(Conditions, Detect,
                         testing::Values(DiscCondition{"noise", 8, 8, 0, false, 0, 1, 0, 0.03},
                                         DiscCondition{"noise", 20, 8, 0, false, 0, 1, 0, 0.02},
                                         DiscCondition{"noise", 60, 8, 0, false, 0, 1, 0, 0.02},
                                         DiscCondition{"uneven light", 8, 2, 0.3, false, 0, 1, 0, 0.03},
                                         DiscCondition{"uneven light", 20, 2, 0.3, false, 0, 1, 0, 0.02},
                                         DiscCondition{"touching", 8, 2, 0.2, true, 0, 0.85, 2, 0.08},
                                         DiscCondition{"touching", 12, 2, 0.2, true, 0, 0.97, 0, 0.03},
                                         DiscCondition{"touching", 24, 2, 0.2, true, 0, 0.97, 0, 0.03},
                                         DiscCondition{"clutter", 12, 3, 0.2, false, 20, 0.97, 1, 0.03},
                                         DiscCondition{"clutter", 24, 3, 0.2, false, 20, 0.97, 1, 0.03}));

TEST(DetectNothing, IsFoundWhereThereIsNothing) {
  DrawnScene scene;
  scene.noise = 6;
  Detector detector;
  EXPECT_TRUE(detector.find(grey_of(draw(scene))).empty());
}

TEST(DetectOne, ASingleRobotIsFoundWithItsRadius) {
  DrawnScene scene;
  scene.noise = 3;
  scene.robots = {{{{200.3, 151.8}, 14}, Led::kOff, 0}};
  Detector detector;
  const std::vector<Detection> found = detector.find(grey_of(draw(scene)));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].disc.centre.x_px, 200.3, 0.3);
  EXPECT_NEAR(found[0].disc.centre.y_px, 151.8, 0.3);
  EXPECT_NEAR(found[0].disc.radius_px, 14, 0.7);
}

}  // namespace
}  // namespace kilotwin::track

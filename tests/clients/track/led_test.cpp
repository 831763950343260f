// Colours of drawn LEDs, by class.
#include <gtest/gtest.h>

#include <cmath>

#include "clients/track/led.hpp"
#include "core/base/pose.hpp"
#include "tests/clients/track/drawn_scene.hpp"

namespace kilotwin::track {
namespace {

struct Condition {
  double radius_px, noise, uneven;
};

class LedColours : public testing::TestWithParam<Condition> {};

TEST_P(LedColours, AreRight) {
  const auto [radius_px, noise, uneven] = GetParam();
  int all = 0, right = 0;
  double squares = 0;
  int bearings = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    DrawnScene scene;
    scene.seed = seed;
    scene.noise = noise;
    scene.uneven = uneven;
    scene.width_px = cvRound(40 * radius_px);
    scene.height_px = cvRound(30 * radius_px);
    scene.robots = scatter(scene, 60, radius_px, false);
    const cv::Mat picture = draw(scene);
    std::vector<Circle> discs;
    for (const DrawnRobot& robot : scene.robots) discs.push_back(robot.disc);
    for (std::size_t i = 0; i < discs.size(); ++i) {
      std::vector<Circle> others = discs;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const LedReading reading = read_led(picture, discs[i], others);
      ++all;
      if (reading.led == scene.robots[i].led) ++right;
      if (scene.robots[i].led == Led::kOff || !reading.bearing_rad) continue;
      const double error = wrapped(*reading.bearing_rad - scene.robots[i].led_bearing_rad);
      squares += error * error;
      ++bearings;
    }
  }
  EXPECT_GE(right, 0.98 * all) << right << " of " << all;
  EXPECT_GT(bearings, all / 2);
  EXPECT_LT(std::sqrt(squares / bearings), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Conditions, LedColours,
                         testing::Values(Condition{8, 2, 0}, Condition{8, 6, 0.2}, Condition{12, 6, 0.25},
                                         Condition{24, 6, 0.25}));

}  // namespace
}  // namespace kilotwin::track

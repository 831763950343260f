/// Pictures of discs with known centres, for the tests of the tracker: drawn at four times the resolution and reduced.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "clients/track/led.hpp"

namespace kilotwin::track {

struct DrawnRobot {
  Circle disc;
  Led led = Led::kOff;
  double led_bearing_rad = 0;  ///< with y up
};

struct DrawnScene {
  int width_px = 640, height_px = 480;
  std::vector<DrawnRobot> robots;
  double noise = 0;   ///< standard deviation, grey levels
  double uneven = 0;  ///< light at the left edge is brighter by this share, and darker at the right one
  double blur_px = 0.7;
  int clutter = 0;  ///< lines, rectangles and cables
  cv::Vec3b floor{185, 190, 188};
  std::uint64_t seed = 1;
};

/// Blue, green, red.
[[nodiscard]] cv::Mat draw(const DrawnScene& scene);

/// `count` robots that do not overlap and keep within the picture; the nearest may touch. Clusters of seven touch where
/// `touching`.
[[nodiscard]] std::vector<DrawnRobot> scatter(const DrawnScene& scene, int count, double radius_px, bool touching);

}  // namespace kilotwin::track

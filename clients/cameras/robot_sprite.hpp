/// The picture of one robot from above, painted once per resolution, and the light of its LED.
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <utility>

#include "clients/cameras/robot_look.hpp"

namespace kilotwin::cameras {

/// A square texture in the robot's frame: column along x (forward), row along y (left), texel (i, j) centred at
/// ((i + 0.5) / texels_per_mm - half_mm, ...). Channels: blue, green, red times coverage, and coverage 0..1.
struct RobotSprite {
  cv::Mat texels;  ///< CV_32FC4
  double texels_per_mm = 1;
  double half_mm = 0;

  /// Bilinear; zero outside.
  [[nodiscard]] cv::Vec4f at(float forward_mm, float left_mm) const;
};

/// Sprites by resolution and variant of the battery; painted at first use.
class RobotSprites {
 public:
  static constexpr std::uint32_t kVariants = 4;

  explicit RobotSprites(const Look& look) : look_(look) {}
  /// For a picture of `px_per_mm`: the texture is as fine as the picture or up to 19 % finer.
  [[nodiscard]] const RobotSprite& at_scale(double px_per_mm, std::uint32_t robot);

 private:
  Look look_;
  std::map<std::pair<int, std::uint32_t>, RobotSprite> painted_;
};

/// The light of an LED at a distance from its middle: how opaque its own picture is, how white, and how much it glows. All 0..1.
struct LedLight {
  float opacity = 0, white = 0, glow = 0;
};
/// Beyond this distance all are 0.
inline constexpr double kLedReach_mm = 14;
[[nodiscard]] LedLight led_light(const Look& look, double distance_mm);
/// Brightness of a colour of the LED at its level 0..3, 0..1.
[[nodiscard]] double led_level(std::uint32_t level);

}  // namespace kilotwin::cameras

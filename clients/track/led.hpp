/// The colour of a robot's LED, from its light against the floor around the robot.
///
/// The floor's own colour near the robot serves as white, so neither uneven light nor the camera's white balance matters. A
/// bright LED saturates the camera in its middle; its colour is then in the glow around.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/track/edge_circle.hpp"

namespace kilotwin::track {

enum class Led : std::uint8_t { kOff, kRed, kGreen, kBlue, kYellow, kMagenta, kCyan, kWhite };

[[nodiscard]] std::string_view name_of(Led);
/// r | g << 2 | b << 4, each 0 or 3: a camera sees the hue, not the level of the drive.
[[nodiscard]] std::uint8_t bits_of(Led);

struct LedReading {
  Led led = Led::kOff;
  /// Far from the borders to other classes, one channel alone or none, and no other robot near: neither a picture that was
  /// exposed during a change, nor a neighbour's light.
  bool clear = false;
  /// Strength of the light: mean excess over the floor's brightness within the spot, 1 is the floor itself.
  double strength = 0;
  /// Where the spot lies from the disc's centre, anticlockwise from x with y up, rad; where it is off the centre.
  std::optional<double> bearing_rad;
};

/// `picture`: blue, green, red, 8 bits. `others`: discs of all other robots, whose LEDs are not this robot's; those
/// farther away cost next to nothing. A picture of one
/// channel has no colours: white or off.
[[nodiscard]] LedReading read_led(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others);

}  // namespace kilotwin::track

#include "clients/cameras/robot_sprite.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kilotwin::cameras {
namespace {

/// Samples per texel and axis.
constexpr int kSamples = 6;
/// Resolutions of textures per octave.
constexpr double kLevelsPerOctave = 4;

constexpr double kLegRadius_mm = 0.8, kLegAt_mm = 14.7;
constexpr double kLedBodyRadius_mm = 1.0;
constexpr double kClipHalfWidth_mm = 2.2;  // the battery's holder, across the cell
constexpr double kTabHalfWidth_mm = 1.1;   // the charging tab, over the rear half
constexpr double kGlintRadius_mm = 1.8;    // a spot of reflected light
constexpr double kSolderRadius_mm = 0.7;   // parts on the board's ring

double distance(double x, double y, double to_x, double to_y) { return std::hypot(x - to_x, y - to_y); }

Colour scaled(const Colour& colour, double by) { return {colour[0] * by, colour[1] * by, colour[2] * by}; }

/// The colour of the board's ring outside the battery.
Colour board_at(const Look& look, double x, double y) {
  for (const double direction : kLegDirections_rad) {
    if (distance(x, y, kLegAt_mm * std::cos(direction), kLegAt_mm * std::sin(direction)) < kLegRadius_mm)
      return look.leg;
  }
  if (distance(x, y, kLedForward_mm, kLedLeft_mm) < kLedBodyRadius_mm) return scaled(look.leg, 0.6);
  constexpr int kParts = 18;
  for (int part = 0; part < kParts; ++part) {
    // Parts lie closer together on the right-hand side, so that the ring is no mirror image of itself.
    const double angle = 2 * kPi * part / kParts + 0.12 * std::sin(3.0 * part);
    const double radius = 13.4 + (part % 3) * 0.75;
    if (distance(x, y, radius * std::cos(angle), radius * std::sin(angle)) < kSolderRadius_mm)
      return part % 2 == 0 ? scaled(look.board, 1.9) : scaled(look.board, 0.45);
  }
  return look.board;
}

/// The colour of the battery, its holder and the glint on it.
Colour battery_at(const Look& look, double x, double y, double brightness) {
  const double radius = std::hypot(x, y);
  Colour colour = scaled(look.battery, brightness);
  // The cell's rim is bevelled; its face is darker towards the rear left.
  if (radius > kBatteryRadius_mm - 0.9) colour = scaled(colour, 0.72);
  colour = scaled(colour, 1 + 0.012 * (x - 0.6 * y));
  if (std::abs(y) < kClipHalfWidth_mm && x < -3.5) colour = scaled(look.board, 1.5);
  if (std::abs(y) < kTabHalfWidth_mm && x < -1.0 && x > -8.0) colour = scaled(look.leg, 1.0);
  if (distance(x, y, 3.4, 2.6) < kGlintRadius_mm) colour = scaled(look.battery, 1.45);
  return colour;
}

RobotSprite paint(const Look& look, double texels_per_mm, double battery_brightness) {
  RobotSprite sprite;
  sprite.texels_per_mm = texels_per_mm;
  const int half = static_cast<int>(std::ceil(kRobotRadius_mm * texels_per_mm)) + 2;
  sprite.half_mm = half / texels_per_mm;
  sprite.texels.create(2 * half, 2 * half, CV_32FC4);
  for (int row = 0; row < 2 * half; ++row) {
    for (int column = 0; column < 2 * half; ++column) {
      cv::Vec4d sum;
      for (int sample = 0; sample < kSamples * kSamples; ++sample) {
        const int along = sample % kSamples, down = sample / kSamples;
        const double x = (column + (along + 0.5) / kSamples) / texels_per_mm - sprite.half_mm;
        const double y = (row + (down + 0.5) / kSamples) / texels_per_mm - sprite.half_mm;
        const double radius = std::hypot(x, y);
        if (radius > kRobotRadius_mm) continue;
        const Colour c =
            radius < kBatteryRadius_mm ? battery_at(look, x, y, battery_brightness) : board_at(look, x, y);
        sum += cv::Vec4d{c[0], c[1], c[2], 1};
      }
      sprite.texels.at<cv::Vec4f>(row, column) = cv::Vec4f(sum / (kSamples * kSamples));
    }
  }
  return sprite;
}

}  // namespace

cv::Vec4f RobotSprite::at(float forward_mm, float left_mm) const {
  const float u = (forward_mm + static_cast<float>(half_mm)) * static_cast<float>(texels_per_mm) - 0.5f;
  const float v = (left_mm + static_cast<float>(half_mm)) * static_cast<float>(texels_per_mm) - 0.5f;
  const float u0 = std::floor(u), v0 = std::floor(v);
  const int column = static_cast<int>(u0), row = static_cast<int>(v0);
  if (column < 0 || row < 0 || column + 1 >= texels.cols || row + 1 >= texels.rows) return {};
  const float fu = u - u0, fv = v - v0;
  const auto* upper = texels.ptr<cv::Vec4f>(row) + column;
  const auto* lower = texels.ptr<cv::Vec4f>(row + 1) + column;
  cv::Vec4f result;
  for (int channel = 0; channel < 4; ++channel) {
    const float top = upper[0][channel] + fu * (upper[1][channel] - upper[0][channel]);
    const float bottom = lower[0][channel] + fu * (lower[1][channel] - lower[0][channel]);
    result[channel] = top + fv * (bottom - top);
  }
  return result;
}

const RobotSprite& RobotSprites::at_scale(double px_per_mm, std::uint32_t robot) {
  const int level = static_cast<int>(std::ceil(kLevelsPerOctave * std::log2(px_per_mm)));
  const std::uint32_t variant = robot % kVariants;
  const auto key = std::make_pair(level, variant);
  if (const auto found = painted_.find(key); found != painted_.end()) return found->second;
  const double spread = 2.0 * variant / (kVariants - 1) - 1;
  return painted_
      .emplace(key, paint(look_, std::exp2(level / kLevelsPerOctave), 1 + look_.battery_variety * spread))
      .first->second;
}

LedLight led_light(const Look& look, double distance_mm) {
  if (distance_mm >= kLedReach_mm) return {};
  // The picture of the LED is opaque up to 2.4 mm and gone at 4.4 mm; its white middle is gone at 2 mm. The sizes were
  // chosen after a photograph of 50 real robots; nothing measures how close they come.
  const auto falls = [distance_mm](double from_mm, double to_mm) {
    const double t = std::clamp((distance_mm - from_mm) / (to_mm - from_mm), 0.0, 1.0);
    return 1 - t * t * (3 - 2 * t);
  };
  const double fade = falls(0.6 * kLedReach_mm, kLedReach_mm);
  return {static_cast<float>(falls(2.4, 4.4)), static_cast<float>(look.led_white * falls(0.6, 2.0)),
          static_cast<float>(look.led_glow * std::exp(-distance_mm / 6.0) * fade)};
}

double led_level(std::uint32_t level) {
  // A camera's response to light is not linear: a third of the current looks brighter than a third.
  constexpr std::array<double, 4> kLevels{0, 0.62, 0.84, 1};
  return kLevels[std::min<std::size_t>(level, kLevels.size() - 1)];
}

}  // namespace kilotwin::cameras

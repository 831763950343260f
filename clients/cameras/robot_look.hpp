/// The look of a Kilobot from above: measures and colours. Free of OpenCV, so that trackers can read the measures too.
///
/// Measures are in the robot's frame: x forward, y left, origin at the centre of the disc. Colours are blue, green, red in
/// grey levels 0..255 as a camera with gain 1 shows them.
#pragma once

#include <array>

#include "core/base/pose.hpp"

namespace kilotwin::cameras {

/// The LED of a Kilobot: 10 mm ahead of the centre and 11 mm to the right. Source: the body model of gym-kilobots, whose
/// front leg is at the same rim as here. The photographs of real robots show the LED near the rim as well.
inline constexpr double kLedForward_mm = 10.0, kLedLeft_mm = -11.0;

/// The coin cell covers the middle of the board. Source: the cell LIR2477 is 24.5 mm wide; measured on a photograph:
/// 0.71 of the disc's radius.
inline constexpr double kBatteryRadius_mm = 12.0;

/// Directions of the three legs, seen from the centre: one at the front rim, two on the axle behind.
inline constexpr std::array<double, 3> kLegDirections_rad{0.0, 2 * kPi / 3, -2 * kPi / 3};

/// Blue, green, red; grey levels.
using Colour = std::array<double, 3>;

/// Surfaces. The defaults follow photographs of robots on a white board under room light.
struct Look {
  Colour floor{196, 200, 198};
  Colour wall{120, 128, 132};
  Colour obstacle{88, 104, 122};
  Colour movable{96, 140, 176};
  Colour outside{84, 86, 88};  ///< beyond the walls
  Colour board{36, 42, 38};
  Colour battery{112, 118, 124};
  Colour leg{150, 152, 154};
  double wall_width_mm = 12;
  /// Amplitude of the floor's texture, grey levels.
  double floor_texture = 2;
  /// Share of light that a robot's soft shadow takes from the floor beside it, 0..1. It falls away from `light_from_rad` of the
  /// camera model.
  double shadow = 0;
  /// Height of the disc's visible face above the floor. 0: no parallax.
  double body_height_mm = 0;
  /// Batteries of single robots differ in brightness by up to this share, 0..1.
  double battery_variety = 0.15;
  /// Share of white in the middle of a lit LED, which is how an overexposed LED looks, 0..1.
  double led_white = 0.4;
  /// Share of the LED's light that falls beside it, as glow, 0..1.
  double led_glow = 0.45;
};

}  // namespace kilotwin::cameras

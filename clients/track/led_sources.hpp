/// The light of robots that stand close together, as a sum of their LEDs.
///
/// Near the border of two robots, the light of both LEDs falls on the same pixels. There each robot gets one source of light
/// with a known falloff, somewhere on the ring where Kilobots carry their LED, and all sources are fitted together.
#pragma once

#include <optional>
#include <vector>

#include "clients/track/led_light.hpp"

namespace kilotwin::track {

/// A window of this size, radii, holds all sources that reach a robot's own LED.
inline constexpr double kSourcesReach = 1.9;
/// Robots whose centres are farther apart than this, radii, light no pixel together.
inline constexpr double kSharedLight = 2.5;

struct LedSource {
  Point at;          ///< its middle
  Colour colour{};   ///< difference of the channels from the least one, relative to the floor, in the middle
  double white = 0;  ///< light in which the channels are alike
  std::vector<Point> others;  ///< middles of the sources of other robots
};

/// The source of `disc` itself; nothing if its LED is dark. `light`: around `disc`, of kSourcesReach.
/// `near`: the robots within kSharedLight; the first eleven count.
[[nodiscard]] std::optional<LedSource> own_source(const Light& light, const Circle& disc,
                                                  const std::vector<Circle>& near);

}  // namespace kilotwin::track

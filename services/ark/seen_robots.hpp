/// The robots as the station sees them: true, or as its cameras and tracker show it. Nothing else of the swarm reaches plugins.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/swarm_view.hpp"

namespace kilotwin::ark {

/// Classes of LEDs that ARK tells apart, with its numbers.
enum class LedClass : std::uint8_t { kOff = 0, kRed = 1, kGreen = 2, kBlue = 3 };

/// Of a LED of r | g << 2 | b << 4, levels 0..3, by the scores of ARK's tracker: r - (.65 b + .75 g), g - (.65 b + .6 r),
/// b - (.6 r + .56 g). The largest score above 0 wins; mixtures without one count as off.
[[nodiscard]] LedClass led_class(std::uint8_t led);

/// Whether a tracked robot is not there: it is lost, has left, or has not been seen yet. Its pose is then an old one.
[[nodiscard]] inline bool is_absent(const SwarmView& swarm, std::uint32_t robot) {
  return LifeCycle{swarm.life_cycle[robot]} == LifeCycle::kAbsent;
}

/// By the robot's number as the station knows it. Lengths mm, times s, angles rad.
struct SeenRobots {
  std::vector<double> x_mm, y_mm, heading_rad;
  std::vector<double> vx_mm, vy_mm;  ///< per second, of the centre; what the motion buffers say with a camera
  std::vector<LedClass> led;
  std::vector<std::uint8_t> seen;  ///< 0: lost, and the rest is what was seen last

  void resize(std::size_t robots) {
    for (auto* const column : {&x_mm, &y_mm, &heading_rad, &vx_mm, &vy_mm}) column->resize(robots, 0);
    led.resize(robots, LedClass::kOff);
    seen.resize(robots, 1);
  }
};

}  // namespace kilotwin::ark

/// A floor of its own for tests: points that do the robots' program by an integrator, random numbers and a way of hearing that
/// are not those of the project, and effects of shapes that no candidate has. Robots are solid discs without friction.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid::test {

enum class Truth {
  kNothing,
  kTwoKindsOfRobots,  ///< a third of them goes at 0.55 of the speed
  kCaughtByWalls,     ///< who comes to a wall is held for 40 to 200 s with a chance of 0.25
  kDeadPatch,         ///< an ellipse off the middle in which everybody goes at half the speed
  kSlowerAtHalfTime,  ///< at half of the run speeds fall to 0.75, at once
  kTired,             ///< speeds fall with the square root of time, to 0.65 at the end
  kSlowCorner,        ///< within 600 mm of the corner at the origin everybody goes at 0.4 of the speed
  kDriftInTheMiddle,  ///< along y, at 1.5 mm/s in the middle between the long walls, falling to nothing there
  kTurningSpells,     ///< robots turn to one side by 0.12 rad/s for spells of 40 to 120 s, half of the time
  kSlowInCrowds,      ///< with two others or more within 90 mm a robot goes at half the speed
};

/// `robots` on the floor for `duration_s`.
[[nodiscard]] FloorRun play(Truth, std::size_t robots, double duration_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid::test

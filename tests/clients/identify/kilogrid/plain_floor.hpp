/// An independent floor simulator for tests: its integrator, random numbers and reception model are not the
/// project's, and its effects have shapes that no candidate has. Robots are solid discs without friction.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid::test {

enum class Truth {
  kNothing,
  kTwoKindsOfRobots,  ///< a third of the robots drive at 0.55 of the speed
  kCaughtByWalls,     ///< at a wall a robot stalls for 40 to 200 s with probability 0.25
  kDeadPatch,         ///< half speed in an ellipse off the centre
  kSlowerAtHalfTime,  ///< speeds fall to 0.75 at half of the run, at once
  kTired,             ///< speeds fall with the square root of time, to 0.65 at the end
  kSlowCorner,        ///< 0.4 of the speed within 600 mm of the corner at the origin
  kDriftInTheMiddle,  ///< 1.5 mm/s along y in the middle between the long walls, falling to 0 there
  kTurningSpells,     ///< turn rate 0.12 rad/s in episodes of 40 to 120 s, half of the time
  kSlowInCrowds,      ///< half speed with two or more others within 90 mm
};

/// Simulates `robots` robots for `duration_s`.
[[nodiscard]] FloorRun play(Truth, std::size_t robots, double duration_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid::test

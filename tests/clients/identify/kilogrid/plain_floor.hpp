/// A floor of its own for tests: points that do the robots' program by an integrator, random numbers and a way of hearing that
/// are not those of the project, and effects of shapes that no candidate has. Robots pass through each other.
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
};

/// `robots` on the floor for `duration_s`.
[[nodiscard]] FloorRun play(Truth, std::size_t robots, double duration_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid::test

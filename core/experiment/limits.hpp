/// Limits of an experiment that are not ranges of single fields.
#pragma once

#include <cstdint>

#include "core/base/pose.hpp"

namespace kilotwin {

inline constexpr std::uint32_t kMostRobots = 100'000;  ///< in all groups together
inline constexpr int kMostGroups = 256;
inline constexpr int kMostMovables = 1000, kMostObstacles = 1000;
inline constexpr int kMostVariables = 64;
inline constexpr int kMostEffects = 256, kMostFields = 16;
/// ARK messages carry 10-bit robot ids, and 1023 marks an unused slot.
inline constexpr std::uint32_t kMostArkRobots = 1022;
/// Robots' centres may be closer than a diameter by this much, mm, to allow for rounding.
inline constexpr double kTouchTolerance_mm = 1e-6;

}  // namespace kilotwin

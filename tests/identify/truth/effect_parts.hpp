/// Shared parts of effects.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

constexpr double kPi = 3.14159265358979323846;

inline void slow_both(Push& push, double factor) {
  push.gain.left *= factor;
  push.gain.right *= factor;
}

inline double square(double x) { return x * x; }

}  // namespace kilotwin::truth

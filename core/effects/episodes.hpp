/// Random numbers of episodes (Episodes of idl/effects.proto).
#pragma once

#include "core/math/elementary.h"
#include "core/plan/effect_settings.hpp"

namespace kilotwin {

/// Time from the end of an episode to the next, s: exponential. `uniform`: in (0, 1].
[[nodiscard]] inline double episode_wait_s(const EpisodesShape& e, double uniform) {
  return -e.mean_apart_s * kt_log(uniform);
}

/// Duration, s: of the Burr XII distribution (Lomax for a shape of 1), without the bound `longest_s`. `uniform`: in (0, 1].
[[nodiscard]] inline double episode_length_s(const EpisodesShape& e, double uniform) {
  const double power = kt_pow(uniform, -1 / e.tail) - 1;
  return e.scale_s * (e.shape == 1 ? power : kt_pow(power, 1 / e.shape));
}

}  // namespace kilotwin

/// The loop over driven robots. A source includes this file and is compiled for one instruction set.
#pragma once

#include "core/math/sine_series.h"
#include "services/physics/drive_kernel.hpp"
#include "services/physics/lanes.hpp"

namespace kilotwin::physics {
namespace {

/// For angles in [-pi, pi]: the same steps and bits as kt_sincos. No such angle except 0 is close enough to a multiple of
/// pi/2 to need kt_sincos' longer argument reduction.
inline void sines_and_cosines(Lanes angle, Lanes& sine, Lanes& cosine) {
  const Lanes zero = all(0), half = all(0.5), one = all(1), whole = all(kWholeNumbers);
  const Lanes turns = (angle * all(kTwoOverPiRounded) + whole) - whole;
  const Lanes first = angle - turns * all(kHalfPi1), second = turns * all(kHalfPi2), value = first - second;
  const Lanes rest = ((first - value) - second) - turns * all(kHalfPi3);
  const Lanes r = value + rest, r_rest = (value - r) + rest;

  const Lanes z = r * r, z2 = z * z;
  const auto term = [](const double* c, Lanes x) { return all(c[0]) + all(c[1]) * x; };
  const Lanes sine_series =
      term(kSine, z) + z2 * (term(kSine + 2, z) + z2 * (term(kSine + 4, z) + z2 * all(kSine[6])));
  const Lanes sine_of_r = r + (r * z * sine_series + r_rest * (one - half * z));
  const Lanes cosine_series = term(kCosine, z) + z2 * (term(kCosine + 2, z) + z2 * term(kCosine + 4, z));
  const Lanes half_z = half * z, most = one - half_z;
  const Lanes cosine_of_r = most + (((one - most) - half_z) + (z * z * cosine_series - r * r_rest));

  // Number of right angles removed by the reduction: -2 .. 2.
  const auto odd = (turns * turns > half) & (all(2) > turns * turns);
  const Lanes swapped_sine = chosen(odd, cosine_of_r, sine_of_r),
              swapped_cosine = chosen(odd, sine_of_r, cosine_of_r);
  const auto turned_back = (zero > turns), far = turns * turns > all(2);
  sine = chosen(turned_back, -swapped_sine, swapped_sine);
  sine = chosen(far, -sine_of_r, sine);
  cosine = chosen(turns > zero, -swapped_cosine, swapped_cosine);
  cosine = chosen(far, -cosine_of_r, cosine);
}

bool integrate(const DriveGeometry& geometry, const DriveColumns& c, std::size_t eights) {
  const Lanes half_tick = all(geometry.half_tick_s), turn_per_speed = all(geometry.tick_s_per_base_mm);
  const Lanes offset = all(geometry.axle_offset_mm), one = all(1);
  Lanes largest_turn = all(0);
  for (std::size_t i = 0; i < eights * kLanes; i += kLanes) {
    const Lanes left = load(c.left_mm_s + i), right = load(c.right_mm_s + i), part = load(c.part + i);
    const Lanes whole_turn = (right - left) * turn_per_speed;
    store(whole_turn, c.turn_rad + i);
    largest_turn = larger(largest_turn, larger(whole_turn, -whole_turn));
    const Lanes run = (left + right) * half_tick * part, turn = whole_turn * part, square = turn * turn;
    const Lanes sine =
        one + square * (all(-1.0 / 6) +
                        square * (all(1.0 / 120) + square * (all(-1.0 / 5040) + square * all(1.0 / 362880))));
    const Lanes versine =
        all(0.5) + square * (all(-1.0 / 24) + square * (all(1.0 / 720) + square * (all(-1.0 / 40320) +
                                                                                   square * all(1.0 / 3628800))));
    const Lanes sin_turn = turn * sine, one_minus_cos = turn * (turn * versine);
    const Lanes forward = run * sine - offset * one_minus_cos;
    const Lanes sideways = run * (turn * versine) + offset * sin_turn;
    Lanes s, o;
    sines_and_cosines(load(c.heading_rad + i), s, o);
    store(o * forward - s * sideways, c.x_mm + i);
    store(s * forward + o * sideways, c.y_mm + i);
    store(one - one_minus_cos, c.cos_turn + i);
    store(sin_turn, c.sin_turn + i);
  }
  return !(largest(largest_turn) > kSeriesTurn_rad);
}

}  // namespace
}  // namespace kilotwin::physics

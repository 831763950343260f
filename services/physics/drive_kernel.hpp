/// The loop over driven robots, compiled once per instruction set. All versions give the same bits. drive.hpp states the
/// model.
#pragma once

#include <cstddef>

namespace kilotwin::physics {

/// Up to this turn per step, the two series of the arc have an error of about one unit in the last place, rad.
inline constexpr double kSeriesTurn_rad = 0.125;

/// Constants of an arc: half the tick, the tick over the wheel base, and the distance of the centre ahead of the axle.
struct DriveGeometry {
  double half_tick_s, tick_s_per_base_mm, axle_offset_mm;
};

/// Columns of Drives, padded to multiples of eight. The kernel reads the first four and writes the others.
struct DriveColumns {
  const double *left_mm_s, *right_mm_s, *heading_rad, *part;
  double *turn_rad, *x_mm, *y_mm, *cos_turn, *sin_turn;
};

struct DriveKernel {
  const char* name;
  /// Fills entries [0, 8 x `eights`), for headings in [-pi, pi]. Returns false if a turn exceeds kSeriesTurn_rad; the caller
  /// must then recompute those entries.
  bool (*integrate)(const DriveGeometry&, const DriveColumns&, std::size_t eights);
};

/// The kernels that this processor can run, the fastest first.
std::size_t drive_kernels(const DriveKernel* (&kernels)[3]);

}  // namespace kilotwin::physics

/// The loop over driven robots, compiled once for each instruction set; all of them give the same bits. drive.hpp has the law.
#pragma once

#include <cstddef>

namespace kilotwin::physics {

/// Up to this turn per step the two series of the arc are exact to the last bit or so, rad.
inline constexpr double kSeriesTurn_rad = 0.125;

/// What a robot's arc follows from: half of the tick, the tick over the wheel base, and how far ahead of the axle the centre is.
struct DriveGeometry {
  double half_tick_s, tick_s_per_base_mm, axle_offset_mm;
};

/// Columns of Drives, whole eights; the first four are read.
struct DriveColumns {
  const double *left_mm_s, *right_mm_s, *heading_rad, *part;
  double *turn_rad, *x_mm, *y_mm, *cos_turn, *sin_turn;
};

struct DriveKernel {
  const char* name;
  /// Fills entries [0, 8 x `eights`), for headings within [-pi, pi]. False where some turn is too large for the series: those
  /// entries are to be computed again.
  bool (*integrate)(const DriveGeometry&, const DriveColumns&, std::size_t eights);
};

/// The ones that this processor can run, the fastest first.
std::size_t drive_kernels(const DriveKernel* (&kernels)[3]);

}  // namespace kilotwin::physics

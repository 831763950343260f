/// What carries a robot that turns about: its velocities lie on a circle, whose radius is its own speed and whose centre is what
/// it is carried by. No heading is needed for it.
#pragma once

#include <complex>
#include <span>

namespace kilotwin::bristle {

struct VelocityCircle {
  std::complex<double> drift = 0;  ///< the centre, in radii
  double speed_mm_s = 0;           ///< the radius
  double one_way =
      1;  ///< 0: it went in all directions alike; 1: in one only, and the drift is what was believed before
};

/// Through velocities in mm/s, outliers counting less. `believed`: the drift that `instants` further velocities would say.
[[nodiscard]] VelocityCircle circle_through(std::span<const std::complex<double>> velocities,
                                            std::complex<double> believed, double instants);

}  // namespace kilotwin::bristle

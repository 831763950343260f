/// Drift of a turning robot: its velocities form a circle. The radius is its own speed, the centre is the drift.
/// Headings are not needed.
#pragma once

#include <complex>
#include <span>

namespace kilotwin::bristle {

struct VelocityCircle {
  std::complex<double> drift = 0;  ///< the centre, in radii
  double speed_mm_s = 0;           ///< the radius
  double prior_share = 1;  ///< 0: directions cover the circle; 1: a single direction, so the drift is the prior's
};

/// Robust circle fit through velocities in mm/s. `believed`: prior drift with the weight of `instants` velocities.
[[nodiscard]] VelocityCircle fit_circle(std::span<const std::complex<double>> velocities,
                                        std::complex<double> prior_drift, double instants);

}  // namespace kilotwin::bristle

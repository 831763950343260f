/// Ends of intervals by profile likelihood (Wilks 1938).
#pragma once

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {

/// By which the profile log likelihood falls at the ends of a 95 % interval: half the quantile of chi-squared with one
/// degree, 3.841 / 2 = 1.96^2 / 2.
inline constexpr double kProfileDrop95 = 1.92;

/// The same where another parameter may be at its bound: an upper bound of the statistic's distribution is then the mixture of
/// chi-squared with one and with two degrees in equal shares (Self and Liang 1987). The drop d solves
/// P(chi-squared_1 > 2 d) + exp(-d) = 0.1.
inline constexpr double kProfileDropAtBound95 = 2.57;

/// The distance from the maximum at which a log likelihood has fallen by `most`. `drop(distance)`: by which it has fallen;
/// `first`: where the search starts. Infinite if it has not fallen so far at `farthest`.
template <class Drop>
double profile_distance(Drop&& drop, double first, double farthest, double most = kProfileDrop95) {
  constexpr int kMostTries = 12;    // points of the profile, often a fit each; fewer end farther from the drop
  const double near = 0.08 * most;  // 4 % of the distance
  double inside = 0, outside = INFINITY, at = std::min(first, farthest);
  for (int n = 0; n < kMostTries; ++n) {
    const double fallen = std::max(drop(at), 0.0);
    if (std::abs(fallen - most) < near) return at;
    (fallen < most ? inside : outside) = at;
    if (inside >= farthest) return INFINITY;
    // The drop of a parabola, within four times the distance and between the known points.
    double next = at * std::sqrt(most / std::max(fallen, most / 16));
    if (!(next > inside) || !(next < outside)) next = std::isfinite(outside) ? (inside + outside) / 2 : 2 * at;
    at = std::min(next, farthest);
  }
  return at;
}

}  // namespace kilotwin::identify

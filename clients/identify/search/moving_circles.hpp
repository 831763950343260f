/// Patterns that move over the floor or spread: curves of the speed over the distance from a centre that moves uniformly, less a
/// radius that grows uniformly.
#pragma once

#include <vector>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// A circle within which the speed residuals differ from those elsewhere.
struct MovingCircle {
  MovingPoint centre;
  double radius_mm = 0;  ///< at the start of the run
  double gain = 0;       ///< estimated gain in log likelihood of one amplitude within the circle
};

/// The best circles of a scan over their positions and radii at the start and at the end of a run. Circles that stand still are left
/// out: they are patterns of the position. Empty if robots cover too little of floor and time.
[[nodiscard]] std::vector<MovingCircle> moving_circles_of(const Fitter&, const FitState&, const Extent&);

/// A hypothesis for each circle: a curve over the distance from its centre.
[[nodiscard]] Dictionary dictionary_of_circles(const FitState&, const Extent&, const std::vector<MovingCircle>&);

/// A curve over a coordinate of the place, kPointDistance or kAlong, over the range that the tracks cover, as cosines.
[[nodiscard]] Factor curve_over(const FitState&, const Axis&, std::uint32_t columns);

/// The derivatives of a block's curve by the numbers of its centre or its direction: as Factor::Shape::kPointShift, with velocity
/// and growth over `unit_s`.
[[nodiscard]] Block derivatives_of(const Term&, std::size_t block, double unit_s);

/// Whether a term is a curve over the distance from a moving centre.
[[nodiscard]] bool is_moving_circle(const Term&);

/// Fits position and velocity of the centre and the growth, by Gauss-Newton steps on the likelihood of the tracks. A velocity or a
/// growth becomes 0 if that is as likely. A circle that stands still becomes an effect of the position, with its name. Returns
/// whether a number changed.
bool refine_moving_circle(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

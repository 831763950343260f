/// Intervals of the points at which effects step: instants, distances, places; and of the radii within which neighbours count. The
/// likelihood has a corner there, so that no standard deviation describes it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "clients/identify/fit/uncertainty.hpp"

namespace kilotwin::identify {

/// By which the profile log likelihood of a step's point falls at the ends of a 95 % interval: half the quantile of a statistic x with
/// the distribution (1 - exp(-x / 2))^2 (Hansen, Econometrica 68, 2000): -log(1 - sqrt(0.95)).
inline constexpr double kStepDrop95 = 3.676;

/// A point at which a term steps, or a radius within which it counts neighbours, and the ends of its 95 % interval.
struct StepInterval {
  std::size_t term = 0;
  Axis axis;
  double at = 0;
  bool is_radius = false;  ///< of all neighbour covariates of the term with this reach, 10 mm to kListed_mm
  /// Nothing: the likelihood does not fall so far on that side.
  std::optional<double> low = {}, high = {};
};

/// Of all steps and radii of the model, by profile likelihood: base parameters, biases and coefficients follow the point.
/// The dispersion of the scores widens the fall.
[[nodiscard]] std::vector<StepInterval> step_intervals_of(const Fitter&, const FitState&, const Uncertainty&);

}  // namespace kilotwin::identify

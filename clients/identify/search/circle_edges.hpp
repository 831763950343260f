/// Circles with a sharp edge: one step over the distance from a centre in place of a curve.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/search.hpp"

namespace kilotwin::identify {

/// Prior standard deviation of coefficients of circles before their first fit: of gains, or of rad/s.
inline constexpr double kCircleSd = 0.3;
/// Log of the number of choices for one number of a circle.
inline constexpr double kCircleNumber = 3;

/// Price of the choice of a circle's numbers, nat.
[[nodiscard]] double cost_of_circle(const Term&);

/// Fits until the likelihood settles: the base speeds move far when a curve becomes a step.
void settle(const Fitter&, FitState&);

/// Moves a number of a term, by a distance in mm.
using MoveNumber = std::function<void(Term&, double by_mm)>;

/// Moves numbers by steps as long as the likelihood rises: first by `first_mm`, which is halved down to 0.7 mm. An edge has no slope
/// that Gauss-Newton steps could follow. Ends early at `most_work` (PreparedSet::work).
void climb(const Fitter&, FitState&, std::size_t term, double first_mm, const std::vector<MoveNumber>&,
           std::uint64_t most_work);

/// Gives each block of a term one step at a radius, mm, in place of its curve, and fits it.
void put_edges(const Fitter&, FitState&, std::size_t term, const std::vector<double>& radii_mm);

/// Gives each circle that moves or grows an edge in place of its curve if the evidence rises. An edge that only grows or only moves is
/// preferred if that is as likely; one that does neither would be a patch of the floor, and is left out. Ends early at `most_work`. Returns whether one got an edge.
bool sharpen_moving_circles(const Fitter&, Search&, std::uint64_t most_work);

}  // namespace kilotwin::identify

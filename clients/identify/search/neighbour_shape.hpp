/// Shape of an effect of neighbours: its range and its dependence on their number and direction.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Replaces a term over neighbours by the combination of forms with the highest evidence: tables of the number
/// within a radius, sums with weights that fall with the distance, curves of the distance of the nearest. Returns
/// false, without a change, for other terms.
bool refine_neighbour_shape(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

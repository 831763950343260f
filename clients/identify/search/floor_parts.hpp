/// Parts of the floor: a map of the speed or of the turn rate as a few discs and half planes.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/search.hpp"

namespace kilotwin::identify {

/// Replaces each map over the position by up to three parts that stand still, where they explain nearly as much. A part has a curve
/// over the distance from a centre (a circle) or along a direction (a border of two floors, a slope), or one step there. Then gives
/// circles that move an edge, where that explains more. `with_curves` of the result is then the model before.
void fit_floor_parts(const Fitter&, Search&);

}  // namespace kilotwin::identify

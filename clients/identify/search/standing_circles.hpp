/// Patches of the floor: a map of the speed or of the turn rate as a few discs.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/search.hpp"

namespace kilotwin::identify {

/// Replaces each map over the position by up to three circles that stand still, where they explain nearly as much. Each circle has
/// a curve over the distance from its centre, or one step at its edge. Then gives circles that move an edge, where that explains more.
/// `with_curves` of the result is then the model before.
void fit_circles(const Fitter&, Search&);

}  // namespace kilotwin::identify

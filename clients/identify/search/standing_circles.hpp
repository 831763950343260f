/// Patches of the floor: a map of the speed or of the turn rate as a few discs.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Replaces a map over the position by up to three circles that stand still, each with a curve over the distance from its centre or
/// with one step at its edge, if they explain nearly as much. Returns whether they replaced it.
bool replace_by_circles(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

/// Further targets of an accepted effect.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Lets a term also act on related targets (one wheel, turn rate, slip, robots at rest, measured heading), as long
/// as the evidence rises.
void extend_targets(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

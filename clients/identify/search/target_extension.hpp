/// What a cause does besides what it was found by.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Lets a term act on more of what its kind of effect acts on (the wheels, the turn rate, slip, robots at rest, the measured
/// heading), as long as the data become more probable by it.
void widen(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

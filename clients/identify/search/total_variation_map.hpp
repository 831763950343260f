/// A map of the floor as fine as the data can tell, with edges as sharp as they are.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Puts, in place of a term's smooth map of the speed over the floor, values at the nodes of a fine grid, of the least total
/// variation that the data allow: edges of any course stay sharp. Only where robots left out of the fit are foretold better.
void sharpen(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

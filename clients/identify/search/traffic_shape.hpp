/// Shape of an effect of traffic: cell size, and the curve over the driven time per cell.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Maximises the evidence over cell size and curve. Returns false, without a change, for other terms.
bool refine_traffic_shape(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

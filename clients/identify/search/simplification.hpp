/// Puts a simple form in place of a curve that it explains as well: a constant, a line, an exponential, one harmonic, one step.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Whether a simpler form took the place of the term's curves.
bool simplify(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

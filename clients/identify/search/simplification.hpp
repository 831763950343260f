/// Replaces a curve by a simple form of about equal evidence: a constant, a line, an exponential, one harmonic,
/// one step.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Returns whether a simpler form replaced the term's curves.
bool simplify(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

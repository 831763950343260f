/// Replaces a curve by a simple form of about equal evidence: a constant, a line, an exponential, one harmonic,
/// one step.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Curves of robots or commands over time: replaced by amplitudes that begin at one instant, or at one instant per robot or
/// command, if those do as well. Returns whether they were replaced.
bool simplify_to_switch(const Fitter&, FitState&, std::size_t term);

/// Returns whether a simpler form replaced the term's curves.
bool simplify(const Fitter&, FitState&, std::size_t term);

/// Whether a term is a drift in the world frame that depends on nothing, although its name says more.
[[nodiscard]] bool is_constant_drift(const Term&);

}  // namespace kilotwin::identify

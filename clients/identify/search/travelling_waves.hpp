/// Patterns that travel over the floor: periodic functions of the phase kx x + ky y - w t.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// The waves of the wheel speed with the largest peaks of the residuals' periodogram, as hypotheses. Empty if robots cover
/// too little of floor and time.
[[nodiscard]] Dictionary wave_dictionary_of(const Fitter&, const FitState&, const Extent&);

}  // namespace kilotwin::identify

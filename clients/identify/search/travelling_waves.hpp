/// Patterns that travel over the floor: periodic functions of the phase kx x + ky y - w t.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// The waves of the wheel speed with the largest peaks of the residuals' periodogram, as hypotheses. Empty if robots cover
/// too little of floor and time.
[[nodiscard]] Dictionary wave_dictionary_of(const Fitter&, const FitState&, const Extent&);

/// Fits wave numbers and frequency of a term that is one wave, by Gauss-Newton steps on the likelihood of the tracks. The
/// periodogram has them only roughly: its residuals contain what the rest of the model missed at that time. A wave that stands
/// still becomes an effect of the position, with its name. Returns whether the wave changed.
bool refine_wave_numbers(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

/// Effects of different strength for different robots, commands, times or places: a common curve times an
/// amplitude.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// If the last term holds amplitudes of another term's curve (add_amplitude_hypotheses), merges both into one
/// term, the last, unless the likelihood falls. Alternates two fits until they converge: the curve with the
/// amplitudes fixed, then the amplitudes with the curve fixed. Returns the former index of the other term, or
/// nothing, with the model unchanged.
[[nodiscard]] std::optional<std::size_t> merge_amplitudes(const Fitter&, FitState&);

/// Whether a term multiplies a curve that another term has fitted.
[[nodiscard]] bool multiplies_known_curve(const Term&);
}  // namespace kilotwin::identify

/// Effects of different strength for different robots, commands, times or places: a common curve times an
/// amplitude.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// If the last term holds amplitudes of another term's function (add_amplitude_hypotheses), merges both into one
/// term, the last, unless the likelihood falls. The term is a product; its functions are fitted in turn
/// (products.hpp). Returns the former index of the other term, or nothing, with the model unchanged.
[[nodiscard]] std::optional<std::size_t> merge_amplitudes(const Fitter&, FitState&);

/// Whether a term holds amplitudes of another term of the model.
[[nodiscard]] bool multiplies_term(const MotionModel&, const Term&);

}  // namespace kilotwin::identify

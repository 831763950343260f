/// Causes of which some robots, commands, times or places show more than others: one curve, times amounts.
#pragma once

#include <optional>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Where the last term holds amounts of a curve that another term found (`hypotheses_of_found`): both become one,
/// the last, if the data are as probable by that. The curve is then fitted with every amount known, since what all show in
/// the mean blurs it; then the amounts with the curve known; and so on until nothing is gained. Returns the place that
/// the other had, or nothing, with the model as it was.
[[nodiscard]] std::optional<std::size_t> join_amounts(const Fitter&, MotionModel&);

/// Whether a term is built on a curve that another has.
[[nodiscard]] bool rests_on_another(const Term&);

}  // namespace kilotwin::identify

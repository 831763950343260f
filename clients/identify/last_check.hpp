/// The last check of a search: which of its models is written. Tracks decide that took part neither in the fit nor in the
/// search, nor give the reported error.
#pragma once

#include <functional>

#include "clients/identify/findings.hpp"
#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Removes terms that do not lower the prediction error of the data of the fit. A small p one step ahead does not suffice.
void keep_predictive_terms(const Fitter&, const MeasuredSet& train, const ForecastTimes&, Search& found);

/// Sets `fit`, `reasons` and `check` of the findings, and keeps of the findings only what concerns terms of this model:
///   - of the models on the path of the search the smallest whose error is within 0.1 % of the least (final_check.hpp). Each forecast
///     counts by the inverse of the variance that the base model expects of it;
///   - then takes out, one at a time, terms whose gain in log likelihood is negative beyond two standard errors; terms whose
///     gain is negative and which do not lower the error clearly; and terms without which the error is no larger;
///   - the base model, if the result predicts worse than it.
void choose_on_held_out(Findings&, const Fitter&, const Evaluation& choosing, const ForecastTimes&);

/// Writes the base model in place of what was found.
void keep_base_model(Findings&);

/// A model without one of its terms, refitted.
[[nodiscard]] FitState without_term(const Fitter&, const FitState&, std::size_t term);

}  // namespace kilotwin::identify

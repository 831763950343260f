/// The search for effects in measured tracks, and a second one beside stalls.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/predict/forecast.hpp"
#include "clients/identify/search/search.hpp"

namespace kilotwin::identify {

/// Searches on the tracks of the fit, from a fitted base model. Spells of stalls look like effects of whatever was so at the time. If
/// stalls remain beside the terms that were found, everything is searched again with these spells known. The models of the result are
/// without stalls.
[[nodiscard]] Search search_tracks(const Fitter&, const FitState& base, const MeasuredSet& train,
                                   const ForecastTimes&, const WorkLog&);

}  // namespace kilotwin::identify

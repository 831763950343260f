/// The last check of a search: which of its models may be written, by data that took no part in choosing them.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/predict/prediction_errors.hpp"

namespace kilotwin::identify {

/// The errors of the models on the path of a search, on held-out data, in the order of the search: the base model first.
/// Returns the index of the last model that
///   - predicts no worse than the base model, and
///   - is not worse than any model before it beyond the 95 % bounds of their difference (prediction_errors.hpp).
/// The base model always qualifies.
[[nodiscard]] std::size_t last_not_worse(const MeasuredSet&, const std::vector<PredictionErrors>& path);

}  // namespace kilotwin::identify

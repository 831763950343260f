#include "clients/identify/predict/final_check.hpp"

namespace kilotwin::identify {
namespace {

/// Relative rise of the error that counts as none: effects of the measurement hardly change predictions.
constexpr double kSame = 1e-3;

bool worse_beyond_bounds(const MeasuredSet& set, const PredictionErrors& smaller, const PredictionErrors& larger) {
  if (larger.rmse_mm() <= smaller.rmse_mm() * (1 + kSame)) return false;
  const std::optional<ErrorBounds> bounds = bounds_of(set, smaller, larger);
  return !bounds || bounds->less_by.high_mm < 0;
}

}  // namespace

std::size_t last_not_worse(const MeasuredSet& set, const std::vector<PredictionErrors>& path) {
  for (std::size_t k = path.size(); k-- > 1;) {
    // Negated, so that an error that is no number does not pass.
    if (!(path[k].rmse_mm() <= path.front().rmse_mm() * (1 + kSame))) continue;
    bool worse = false;
    for (std::size_t j = 0; j < k && !worse; ++j) worse = worse_beyond_bounds(set, path[j], path[k]);
    if (!worse) return k;
  }
  return 0;
}

}  // namespace kilotwin::identify

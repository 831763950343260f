#include "clients/identify/predict/final_check.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {

std::size_t smallest_of_the_best(const std::vector<Candidate>& path) {
  double least_mm = INFINITY;
  for (const Candidate& c : path)
    if (c.rmse_mm < least_mm) least_mm = c.rmse_mm;
  std::size_t chosen = path.size();
  for (std::size_t k = 0; k < path.size(); ++k) {
    if (!(path[k].rmse_mm <= least_mm * (1 + kSameError))) continue;
    if (chosen == path.size() || path[k].size <= path[chosen].size) chosen = k;
  }
  return chosen == path.size() ? 0 : chosen;
}

}  // namespace kilotwin::identify

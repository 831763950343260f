/// The median of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace kilotwin {

/// The upper median: of an even number of values the greater of the two in the middle; 0 of none.
[[nodiscard]] inline double upper_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace kilotwin

/// Order statistics of samples: each rule of a quantile stands here once.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace kilotwin::stats {

/// The value at `rank` in ascending order; 0 is the least. Reorders the values. `rank` must exist.
template <class T> [[nodiscard]] T order_statistic(std::vector<T>& values, std::size_t rank) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The value that `beyond` others exceed, the least if there are no more. For ends of ranges with outliers.
template <class T> [[nodiscard]] T upper_end(std::vector<T>& values, std::size_t beyond) {
  return order_statistic(values, values.size() - 1 - std::min(beyond, values.size() - 1));
}

/// The upper median: of an even number of values the greater of the two in the middle; 0 of none.
template <class T> [[nodiscard]] T upper_median(std::vector<T> values) {
  return values.empty() ? T{0} : order_statistic(values, values.size() / 2);
}

/// The observed value at or below the quantile of `share`, 0..1; 0 of none. Reorders the values.
[[nodiscard]] inline double lower_quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  return order_statistic(values, static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

/// The observed value nearest to the quantile of `share`, 0..1; 0 of none. Reorders the values.
[[nodiscard]] inline double nearest_quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  return order_statistic(values,
                         static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1))));
}

/// The quantile with linear interpolation between observed values (type 7 of Hyndman and Fan, 1996; numpy's default). NaN
/// of no values, or if `share` is not in 0..1. Reorders the values.
[[nodiscard]] inline double interpolated_quantile(std::vector<double>& values, double share) {
  if (values.empty() || !(share >= 0 && share <= 1)) return std::numeric_limits<double>::quiet_NaN();
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const double low = order_statistic(values, below), part = place - static_cast<double>(below);
  if (part == 0) return low;
  return low +
         part * (*std::min_element(values.begin() + static_cast<std::ptrdiff_t>(below) + 1, values.end()) - low);
}

}  // namespace kilotwin::stats

/// Axes: where ticks lie and what they say.
#pragma once

#include <string>
#include <vector>

namespace kilotwin::recorder {

struct AxisTicks {
  std::vector<double> at;          ///< ascending
  std::vector<std::string> label;  ///< of `at`, divided by 10^exponent
  int exponent = 0;                ///< for the axis' title: 0, or a multiple of 3 where numbers would be long
};

/// 1, 2 or 5 times a power of ten: the least that cuts `range` (> 0) into at most `pieces`.
[[nodiscard]] double round_step(double range, int pieces);

/// Multiples of a round step within [low, high], about `pieces` of them, with just the decimals that tell them
/// apart.
[[nodiscard]] AxisTicks linear_ticks(double low, double high, int pieces);

/// Powers of ten within [low, high] (low > 0), with their 2- and 5-fold where the range is below 300.
[[nodiscard]] AxisTicks logarithmic_ticks(double low, double high);

/// "10" with raised digits: 10⁶, 10⁻³.
[[nodiscard]] std::string power_of_ten(int exponent);

}  // namespace kilotwin::recorder

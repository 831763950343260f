/// A parameter that `kilotwin tune` varies: a field of an experiment or a constant of a program, with its range.
#pragma once

#include <string>
#include <vector>

namespace kilotwin::tune {

struct Parameter {
  std::string name;          ///< field of the experiment, or name of a macro
  double low = 0, high = 1;  ///< both allowed; low < high
  bool logarithmic = false;  ///< equal ratios count alike; needs low > 0
  bool whole = false;        ///< takes whole numbers alone
  bool macro = false;        ///< a macro of the program (--define) instead of a field (--set)
};

/// Parses "NAME=A..B" or "NAME=log:A..B". Between whole numbers, written without point and exponent, the values are whole.
/// Throws UserError, which names `option`.
[[nodiscard]] Parameter parse_parameter(const std::string& text, const std::string& option, bool macro);

/// The value at a place of the unit interval: 0 is the lowest, 1 the highest.
[[nodiscard]] double value_at(const Parameter&, double place);
/// "NAME=VALUE", as --set and --define take it. 6 digits.
[[nodiscard]] std::string setting_at(const Parameter&, double place);

}  // namespace kilotwin::tune

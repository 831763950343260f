/// Rows as text for a terminal.
#pragma once

#include <string>
#include <vector>

#include "core/stats/moments.hpp"

namespace kilotwin::cli {

/// "MEAN ±STANDARD ERROR", "MEAN" of a single value, "-" of none.
[[nodiscard]] std::string with_error(const stats::Moments&);

/// Formats rows of equal length as columns, the first left-aligned and the others right-aligned. "±" is one character of two bytes.
[[nodiscard]] std::string aligned(const std::vector<std::vector<std::string>>& rows);

}  // namespace kilotwin::cli

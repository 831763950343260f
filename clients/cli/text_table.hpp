/// Rows as text for a terminal.
#pragma once

#include <string>
#include <vector>

namespace kilotwin::cli {

/// Formats rows of equal length as columns, the first left-aligned and the others right-aligned. "±" is one character of two bytes.
[[nodiscard]] std::string aligned(const std::vector<std::vector<std::string>>& rows);

}  // namespace kilotwin::cli

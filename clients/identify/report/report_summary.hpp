/// The top of the report: what was wrong and by how much it is better, in a headline, a few sentences and bars.
#pragma once

#include <string>

#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// Root mean squares, mm.
struct Errors {
  std::optional<double> before, after, floor;
};
[[nodiscard]] Errors errors_of(const json& contract);

// All as markup.
[[nodiscard]] std::string headline(const json& contract);
[[nodiscard]] std::string verdict(const json& contract);
/// The errors as bars, with their confidence intervals.
[[nodiscard]] std::string bars(const json& contract);
/// Bars of any measure, as the document gives them: as long as they are above `from`.
[[nodiscard]] std::string given_bars(const json& bars);

}  // namespace kilotwin::identify::report

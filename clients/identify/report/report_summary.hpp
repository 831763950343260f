/// Summary of the report: headline, a few sentences, and error bars.
#pragma once

#include <string>

#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// Root mean square errors, mm.
struct Errors {
  std::optional<double> before, after, floor;
};
[[nodiscard]] Errors errors_of(const json& contract);

// All functions return markup.
[[nodiscard]] std::string headline(const json& contract);
[[nodiscard]] std::string verdict(const json& contract);
/// The errors as bars, with their confidence intervals.
[[nodiscard]] std::string bars(const json& contract);
/// Bars of any quantity. A bar starts at `from`.
[[nodiscard]] std::string given_bars(const json& bars);

}  // namespace kilotwin::identify::report

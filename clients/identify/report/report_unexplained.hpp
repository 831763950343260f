/// The section about what the model leaves unexplained.
#pragma once

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// Comparisons as a table, and the patterns of the error as plots. Empty if the result has none.
[[nodiscard]] std::string unexplained_body(const json& unexplained, Figures&);

}  // namespace kilotwin::identify::report

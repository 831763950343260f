/// The simulation check: a section of the report as markup.
#pragma once

#include <string>

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// Method and result; empty if there was no check.
[[nodiscard]] std::string simulated_lead(const json& contract);
/// The table of distances, and plots.
[[nodiscard]] std::string simulated_body(const json& contract, const json& document, Figures&);

}  // namespace kilotwin::identify::report

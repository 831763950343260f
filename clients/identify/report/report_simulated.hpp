/// Simulated beside measured robots: a part of the report as markup.
#pragma once

#include <string>

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// How the check was made and what came of it; empty where there was none.
[[nodiscard]] std::string simulated_lead(const json& contract);
/// The table of distances, and plots.
[[nodiscard]] std::string simulated_body(const json& contract, const json& document, Figures&);

}  // namespace kilotwin::identify::report

/// What was found, what was tried beside it, and what cannot be told apart: parts of the report as markup.
#pragma once

#include <string>

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// A card per effect, with the plots in which it shows best.
[[nodiscard]] std::string cards(const json& contract, const json& document, Figures&);
[[nodiscard]] std::string effects_table(const json& contract);
[[nodiscard]] std::string rejected_table(const json& contract);
[[nodiscard]] std::string ambiguous_list(const json& contract);
/// Residuals over covariates: those of what was found and those that leave a pattern; the others to unfold.
[[nodiscard]] std::string traced(const json& contract, const json& covariate_plots, Figures&);

}  // namespace kilotwin::identify::report

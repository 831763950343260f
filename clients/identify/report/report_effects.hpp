/// Accepted effects, rejected hypotheses and ambiguous effects: sections of the report as markup.
#pragma once

#include <string>

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// A card per effect, with the plots that show it best.
[[nodiscard]] std::string cards(const json& contract, const json& document, Figures&);
[[nodiscard]] std::string effects_table(const json& contract);
[[nodiscard]] std::string rejected_table(const json& contract);
[[nodiscard]] std::string ambiguous_list(const json& contract);
/// Residuals over covariates: those of accepted effects and those with a remaining pattern. The others are folded.
[[nodiscard]] std::string covariate_section(const json& contract, const json& covariate_plots, Figures&);

}  // namespace kilotwin::identify::report

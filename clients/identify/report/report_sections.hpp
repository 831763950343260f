/// The sections of the report as values of identification.mustache. A section without content is no value.
#pragma once

#include <optional>

#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

using identification::Identification, identification::Result;
using Section = std::optional<Data>;

// report_effects.cpp
/// A card per effect, with the plots that show it best.
[[nodiscard]] Section effects_section(const Identification&, Figures&);
[[nodiscard]] Section evidence_section(const Result&);
[[nodiscard]] Section rejected_section(const Result&);
[[nodiscard]] Section ambiguous_section(const Result&);
/// Residuals over covariates: those of accepted effects and those with a remaining pattern. The others are folded.
[[nodiscard]] Section covariate_section(const Identification&, Figures&);

// report_errors.cpp
/// How the errors and the noise floor were estimated; errors over the horizon, after each effect, and by robot.
[[nodiscard]] Section improvement_section(const Identification&, Figures&);
/// Comparisons as a table, and the patterns of the error as plots.
[[nodiscard]] Section unexplained_section(const identification::Unexplained&, Figures&);
[[nodiscard]] Section residual_map_section(const Identification&, Figures&);
/// The table of distances, and plots.
[[nodiscard]] Section simulated_section(const Identification&, Figures&);

// report_model.cpp
/// Fitted parameters with their intervals, and what was measured.
[[nodiscard]] Section model_section(const Identification&);
/// Biases, noise and errors of each robot.
[[nodiscard]] Section robots_section(const Result&);

}  // namespace kilotwin::identify::report

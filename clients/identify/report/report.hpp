/// The report: one HTML file that needs nothing else, for a person who has a minute, and for paper.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace kilotwin::identify {

/// Tells what the document holds (identify.hpp lists its keys): what was wrong, why, by how much it is better. Parts that
/// the document lacks are left out. Plots are drawn by gnuplot; throws RunError where it is missing.
[[nodiscard]] std::string report_html(const nlohmann::json& document);

/// Writes it. Throws RunError.
void write_report(const nlohmann::json& document, const std::filesystem::path& file);

}  // namespace kilotwin::identify

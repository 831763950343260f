/// The report: one self-contained HTML file, readable in a minute, printable.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace kilotwin::identify {

/// Renders the document (identify.hpp lists its keys). Absent entries are left out. gnuplot draws the plots.
/// Throws RunError if it is missing.
[[nodiscard]] std::string report_html(const nlohmann::json& document);

/// Writes the report. Throws RunError.
void write_report(const nlohmann::json& document, const std::filesystem::path& file);

}  // namespace kilotwin::identify

/// The report: one self-contained HTML file, readable in a minute, printable.
#pragma once

#include <filesystem>
#include <string>

#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// Renders a result of any kind of data. Sections without content are left out. gnuplot draws the plots.
/// Throws RunError if it is missing.
[[nodiscard]] std::string report_html(const identification::Identification&);

/// Writes the report. Throws RunError.
void write_report(const identification::Identification&, const std::filesystem::path& file);

}  // namespace kilotwin::identify

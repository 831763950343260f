/// The promises of a planned recording, as JSON and as a page.
#pragma once

#include <filesystem>
#include <string>

#include "clients/identify/design/design.hpp"

namespace kilotwin::cli {

/// One sentence per line: what the plan gives, beside random commands.
[[nodiscard]] std::string design_in_words(const identify::Design&, const identify::DesignQuestion&);

/// Writes design.json, and report.html if gnuplot is installed. `source`: the result that the plan follows from.
void write_design_report(const identify::Design&, const identify::DesignQuestion&, const std::string& source,
                         const std::filesystem::path& directory);

}  // namespace kilotwin::cli

/// The picture of a run in three panels: start, paths and end of all robots.
#pragma once

#include <filesystem>
#include <string>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// SVG with three panels, from all states that remain in the recording; about 100 to 250 bytes per robot for large
/// swarms. Throws UserError where the recording has no state.
[[nodiscard]] std::string picture_svg(Reader& recording);

/// Throws UserError as above, RunError where the file cannot be written.
void write_picture(Reader& recording, const std::filesystem::path& file);

}  // namespace kilotwin::recorder

/// The picture of a run in three panels: start, paths and end of all robots.
#pragma once

#include <filesystem>
#include <string>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// SVG with three panels, from all remaining states of the recording. Its size is about 100 to 250 bytes per robot for large
/// swarms. Throws UserError if the recording has no state.
[[nodiscard]] std::string picture_svg(Reader& recording);

/// Throws UserError as picture_svg(), RunError if the file cannot be written.
void write_picture(Reader& recording, const std::filesystem::path& file);

}  // namespace kilotwin::recorder

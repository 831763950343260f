/// Pictures from SVG text, by librsvg.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kilotwin::movie {

/// The picture of an SVG document, drawn into width x height px: rows from the top, 4 octets a pixel, blue, green, red and one
/// without meaning. Safe to call from several threads. Throws RunError if the text is no SVG.
[[nodiscard]] std::vector<std::uint8_t> rasterised(const std::string& svg, int width_px, int height_px);

}  // namespace kilotwin::movie

/// Text, colours and the document frame that all pictures share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace kilotwin::recorder::svg {

inline constexpr std::string_view kInk = "#1f2933";    ///< text and outlines
inline constexpr std::string_view kFaint = "#66727f";  ///< explanations
inline constexpr std::string_view kLine = "#c8d0d9";   ///< grids and frames
inline constexpr std::string_view kPaper = "#ffffff";

/// Colours of series and groups; distinguishable for colour-blind readers and in print.
inline constexpr std::array<std::string_view, 8> kPalette = {"#2563a8", "#d95f0e", "#2a8f5b", "#a03a8c",
                                                             "#b8860b", "#4aa3c7", "#c0392b", "#5b5f97"};

/// Text for XML: markup is escaped; invalid UTF-8 and control characters become '?'.
[[nodiscard]] std::string escaped(std::string_view text);

/// The first `most` characters, followed by an ellipsis if the text is longer.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most);

/// Approximate width of a line, px: the mean advance of sans-serif fonts is 0.55 of their size.
[[nodiscard]] double text_width_px(std::string_view text, double size_px);

enum class Anchor { kStart, kMiddle, kEnd };

/// A line of text with its baseline at (x, y), px.
[[nodiscard]] std::string text(double x, double y, double size_px, std::string_view line,
                               std::string_view colour = kInk, Anchor anchor = Anchor::kStart, bool bold = false);

/// The SVG document around `body`, with a background of its own for light and dark pages. `description`: for screen readers.
[[nodiscard]] std::string document(double width_px, double height_px, std::string_view title,
                                   std::string_view description, std::string_view body);

/// Colour of a robot's LED (r | g << 2 | b << 4) on paper; off is light grey.
[[nodiscard]] std::string led_colour(std::uint8_t led);
/// "off", "red", "dim green"..., or the rgb digits if the colour has no plain name.
[[nodiscard]] std::string led_name(std::uint8_t led);

}  // namespace kilotwin::recorder::svg

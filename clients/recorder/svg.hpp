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

/// Series and groups: distinguishable also with colour-blind eyes and in print.
inline constexpr std::array<std::string_view, 8> kPalette = {"#2563a8", "#d95f0e", "#2a8f5b", "#a03a8c",
                                                             "#b8860b", "#4aa3c7", "#c0392b", "#5b5f97"};

/// Text as XML takes it: markup escaped, bytes that are no UTF-8 or no characters replaced by '?'.
[[nodiscard]] std::string escaped(std::string_view text);

/// The first `most` characters, with an ellipsis where there were more.
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most);

/// Approximate width of a line, px: the mean advance of sans-serif fonts is 0.55 of their size.
[[nodiscard]] double text_width_px(std::string_view text, double size_px);

enum class Anchor { kStart, kMiddle, kEnd };

/// A line of text with its baseline at (x, y), px.
[[nodiscard]] std::string text(double x, double y, double size_px, std::string_view line,
                               std::string_view colour = kInk, Anchor anchor = Anchor::kStart, bool bold = false);

/// The document around `body`, with its own background for light and dark pages. `description` is for screen readers.
[[nodiscard]] std::string document(double width_px, double height_px, std::string_view title,
                                   std::string_view description, std::string_view body);

/// An LED of a robot, r | g << 2 | b << 4, as a colour on paper; off is a light grey.
[[nodiscard]] std::string led_colour(std::uint8_t led);
/// "off", "red", "dim green"..., or the rgb digits where there is no plain word.
[[nodiscard]] std::string led_name(std::uint8_t led);

}  // namespace kilotwin::recorder::svg

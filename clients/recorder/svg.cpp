#include "clients/recorder/svg.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kilotwin::recorder::svg {
namespace {

/// Length of the UTF-8 character at the front; 0 if the bytes are invalid.
std::size_t character_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 && first < 0xf5   ? 4
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xc2 && first < 0xe0 ? 2
                                                             : 0;
  if (length == 0 || length > text.size()) return 0;
  std::uint32_t code = first & (0xffu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fu);
  }
  const bool shortest = length == 2 || (length == 3 && code >= 0x800) || (length == 4 && code >= 0x10000);
  const bool xml =
      (code < 0xd800 || code > 0xdfff) && code <= 0x10ffff && (code & 0xfffe) != 0xfffe && code >= 0xa0;
  return shortest && xml ? length : 0;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_bytes(text);
    const char c = text[0];
    if (length > 1) {
      out += text.substr(0, length);
    } else if (length == 0 || static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += '?';
    } else if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string shortened(std::string_view text, std::size_t most) {
  std::size_t at = 0;
  for (std::size_t characters = 0; at < text.size(); ++characters) {
    if (characters == most) return std::string(text.substr(0, at)) + "\u2026";
    at += std::max<std::size_t>(character_bytes(text.substr(at)), 1);
  }
  return std::string(text);
}

double text_width_px(std::string_view text, double size_px) {
  const auto characters = std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; });
  return 0.55 * size_px * static_cast<double>(characters);
}

std::string text(double x, double y, double size_px, std::string_view line, std::string_view colour, Anchor anchor,
                 bool bold) {
  const std::string_view where = anchor == Anchor::kStart    ? ""
                                 : anchor == Anchor::kMiddle ? " text-anchor=\"middle\""
                                                             : " text-anchor=\"end\"";
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\" fill=\"{}\"{}{}>{}</text>\n", x, y,
                     size_px, colour, where, bold ? " font-weight=\"600\"" : "", escaped(line));
}

std::string document(double width_px, double height_px, std::string_view title, std::string_view description,
                     std::string_view body) {
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" viewBox=\"0 0 {0:g} {1:g}\" "
      "role=\"img\" "
      "font-family=\"system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', Arial, sans-serif\">\n"
      "<title>{2}</title>\n<desc>{3}</desc>\n<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"{4}\"/>\n",
      width_px, height_px, escaped(title), escaped(description), kPaper);
  out += body;
  out += "</svg>\n";
  return out;
}

std::string led_colour(std::uint8_t led) {
  if ((led & 63) == 0) return "#dde3ea";
  // Full blue keeps some lightness, so that the tick of the heading is visible on it.
  const auto level = [led](int shift) { return 60 + 65 * (led >> shift & 3); };
  return fmt::format("#{:02x}{:02x}{:02x}", level(0), level(2), level(4));
}

std::string led_name(std::uint8_t led) {
  const int r = led & 3, g = led >> 2 & 3, b = led >> 4 & 3;
  const int brightest = std::max({r, g, b});
  if (brightest == 0) return "off";
  const auto plain = [brightest](int channel) { return channel == 0 || channel == brightest; };
  if (!plain(r) || !plain(g) || !plain(b)) return fmt::format("rgb {}{}{}", r, g, b);
  constexpr std::array<std::string_view, 8> kNames = {"off",  "red",     "green", "yellow",
                                                      "blue", "magenta", "cyan",  "white"};
  const std::size_t which = (r > 0 ? 1u : 0u) + (g > 0 ? 2u : 0u) + (b > 0 ? 4u : 0u);
  return fmt::format("{}{}", brightest < 2 ? "dim " : "", kNames[which]);
}

}  // namespace kilotwin::recorder::svg

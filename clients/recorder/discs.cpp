#include "clients/recorder/discs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "clients/recorder/svg.hpp"

namespace kilotwin::recorder {

namespace {

/// Squares in their LED's colour; a dark cell is paler than a dark robot.
std::string draw_cells(const Snapshot& at, const std::vector<double>& cell_mm, const View& view) {
  std::map<std::uint8_t, std::string> by_led;
  for (std::size_t i = 0; i < cell_mm.size(); ++i) {
    if (!(cell_mm[i] > 0)) continue;
    const long side = std::lround(view.length(kCellPart * cell_mm[i])), half = side / 2;
    put(by_led[at.led[i] & 63], "M{} {}h{}v{}h{}z", view.x(at.x_mm[i]) - half, view.y(at.y_mm[i]) - half, side,
        side, -side);
  }
  std::string out;
  for (const auto& [led, squares] : by_led)
    put(out, "<path class=\"cells\" fill=\"{}\" fill-opacity=\"{}\" d=\"{}\"/>\n", svg::led_colour(led),
        led == 0 ? 0.15 : 0.5, squares);
  return out;
}

}  // namespace

std::string draw_robots(const Snapshot& at, const std::vector<double>& cell_mm, const View& view) {
  std::map<std::uint8_t, std::string> by_led;
  std::string rims, failed_rims, ticks;
  const double disc = disc_units(view), rim = std::clamp(disc * 0.09, 1.5, 18.0), tick = disc * 0.5;
  for (std::size_t i = 0; i < at.x_mm.size(); ++i) {
    if (!cell_mm.empty() && cell_mm[i] > 0) continue;
    const long x = view.x(at.x_mm[i]), y = view.y(at.y_mm[i]);
    put(failed(at, i) ? failed_rims : rims, "M{} {}h1", x, y);
    put(by_led[at.led[i] & 63], "M{} {}h1", x, y);
    put(ticks, "M{} {}l{} {}", x, y, std::lround(tick * std::cos(at.heading_rad[i])),
        -std::lround(tick * std::sin(at.heading_rad[i])));
  }
  std::string out = draw_cells(at, cell_mm, view) + "<g fill=\"none\" stroke-linecap=\"round\">\n";
  put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" d=\"{}\"/>\n", svg::kInk, disc, rims);
  if (!failed_rims.empty()) {
    put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" d=\"{}\"/>\n", kFailedRim,
        disc + std::max(disc * 0.25, 26.0), failed_rims);
  }
  for (const auto& [led, discs] : by_led) {
    put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" d=\"{}\"/>\n", svg::led_colour(led),
        std::max(disc - 2 * rim, disc * 0.5), discs);
  }
  put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-linecap=\"butt\" d=\"{}\"/>\n</g>\n", svg::kInk,
      std::clamp(disc * 0.1, 1.5, 24.0), ticks);
  return out;
}

}  // namespace kilotwin::recorder

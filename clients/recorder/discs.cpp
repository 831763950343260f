#include "clients/recorder/discs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "clients/recorder/svg.hpp"

namespace kilotwin::recorder {

std::string draw_discs(const Snapshot& at, const View& view) {
  std::map<std::uint8_t, std::string> by_led;
  std::string rims, failed_rims, ticks;
  const double disc = disc_units(view), rim = std::clamp(disc * 0.09, 1.5, 18.0), tick = disc * 0.5;
  for (std::size_t i = 0; i < at.x_mm.size(); ++i) {
    const long x = view.x(at.x_mm[i]), y = view.y(at.y_mm[i]);
    put(failed(at, i) ? failed_rims : rims, "M{} {}h1", x, y);
    put(by_led[at.led[i] & 63], "M{} {}h1", x, y);
    put(ticks, "M{} {}l{} {}", x, y, std::lround(tick * std::cos(at.heading_rad[i])),
        -std::lround(tick * std::sin(at.heading_rad[i])));
  }
  std::string out = "<g fill=\"none\" stroke-linecap=\"round\">\n";
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

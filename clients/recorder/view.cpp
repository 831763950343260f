#include "clients/recorder/view.hpp"

#include "clients/recorder/axis.hpp"
#include "clients/recorder/svg.hpp"
#include "core/base/ids.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::recorder {
namespace {

/// Least diameter of a drawn disc.
constexpr double kLeastDisc_px = 1.8;

}  // namespace

double disc_units(const View& view) {
  return std::max(view.length(2 * kRobotRadius_mm), kUnitsPerPx * kLeastDisc_px);
}

std::string time_text(double time_s) { return fmt::format("{:g} s", std::round(time_s * 100) / 100); }

bool failed(const Snapshot& at, std::size_t robot) {
  return at.life_cycle[robot] == static_cast<std::uint8_t>(LifeCycle::kFailed);
}

std::string scale_bar(const View& view, double x, double y) {
  const double length_mm = round_step(view.width_px() / view.px_per_mm(), 10);
  const double length_px = length_mm * view.px_per_mm();
  std::string out = fmt::format(
      "<path d=\"M{0:.1f} {1:.1f}v6M{0:.1f} {2:.1f}h{3:.1f}M{4:.1f} {1:.1f}v6\" fill=\"none\" stroke=\"{5}\" "
      "stroke-width=\"1.6\"/>\n",
      x, y - 3, y, length_px, x + length_px, svg::kInk);
  return out + svg::text(x + length_px + 8, y + 4, kCaption_px, fmt::format("{:g} mm", length_mm));
}

Box extent(const Snapshot& at) {
  Box box;
  for (std::size_t i = 0; i < at.x_mm.size(); ++i) box.add(at.x_mm[i], at.y_mm[i]);
  return box;
}

void add_movables(Box& box, const World& world, const Snapshot& at) {
  for (std::size_t i = 0; i < world.movables.size(); ++i) {
    const double reach_mm = world.movables[i].shape.reach_mm();
    for (const double way_mm : {-reach_mm, reach_mm})
      box.add(at.movable_x_mm[i] + way_mm, at.movable_y_mm[i] + way_mm);
  }
}

Box fitted(const Box& box, double width_px, double height_px) {
  const double px_per_mm = std::min(width_px / box.width_mm(), height_px / box.height_mm());
  const double wider_mm = width_px / px_per_mm - box.width_mm(),
               higher_mm = height_px / px_per_mm - box.height_mm();
  return {box.x_min_mm - wider_mm / 2, box.y_min_mm - higher_mm / 2, box.x_max_mm + wider_mm / 2,
          box.y_max_mm + higher_mm / 2};
}

Box moved_into(const Box& box, const Box& outer) {
  const auto shift = [](double low, double high, double outer_low, double outer_high) {
    return low < outer_low ? outer_low - low : high > outer_high ? outer_high - high : 0.0;
  };
  const double x = shift(box.x_min_mm, box.x_max_mm, outer.x_min_mm, outer.x_max_mm);
  const double y = shift(box.y_min_mm, box.y_max_mm, outer.y_min_mm, outer.y_max_mm);
  return {box.x_min_mm + x, box.y_min_mm + y, box.x_max_mm + x, box.y_max_mm + y};
}

Box zoomed(const Box& inner, const Box& outer) {
  const double size = std::max({inner.width_mm(), inner.height_mm(), 8 * kRobotRadius_mm});
  Box wide = inner.widened(0.06 * size + 2 * kRobotRadius_mm);
  // A single robot or a row of robots gets a margin on all sides.
  const double least = 0.6 * size;
  if (wide.width_mm() < least)
    wide = {wide.x_min_mm - least / 2, wide.y_min_mm, wide.x_max_mm + least / 2, wide.y_max_mm};
  if (wide.height_mm() < least)
    wide = {wide.x_min_mm, wide.y_min_mm - least / 2, wide.x_max_mm, wide.y_max_mm + least / 2};
  const double ratio = std::min(outer.width_mm() / wide.width_mm(), outer.height_mm() / wide.height_mm());
  return ratio >= 1.7 ? wide : outer;
}

}  // namespace kilotwin::recorder

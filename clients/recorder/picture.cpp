#include "clients/recorder/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "clients/recorder/discs.hpp"
#include "clients/recorder/ground.hpp"
#include "clients/recorder/svg.hpp"
#include "clients/recorder/view.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kMargin_px = 28, kGap_px = 26, kTitle_px = 56, kPanelTitle_px = 26, kPanelFoot_px = 48;

constexpr std::string_view kStartDot = "#b4bcc6";
/// Colours of paths and ends by the robot's x at the start, from left to right.
constexpr std::array<std::string_view, 6> kByStart = {"#2b4c9b", "#2387b5", "#2aa58a",
                                                      "#d9a21b", "#e0702a", "#b8336a"};

/// Paths of all robots. Colours follow x at the start, which makes mixing visible.
std::string draw_paths(const RunOverview& run, const View& view, const Box& start) {
  const Paths& paths = run.paths;
  std::array<std::string, kByStart.size()> ways, ends;
  std::string starts;
  const Snapshot& first = paths.first();
  for (std::size_t i = 0; i < paths.robots(); ++i) {
    if (!run.cell_mm.empty() && run.cell_mm[i] > 0) continue;
    const double part = start.width_mm() > 0 ? (first.x_mm[i] - start.x_min_mm) / start.width_mm() : 0;
    const std::size_t group = std::min(static_cast<std::size_t>(part * kByStart.size()), kByStart.size() - 1);
    const std::vector<Point> way = simplified(paths.path(i), 0.3 / view.px_per_mm());
    long x = view.x(way[0].x_mm), y = view.y(way[0].y_mm);
    put(starts, "M{} {}h1", x, y);
    std::string& d = ways[group];
    put(d, "M{} {}", x, y);
    char command = 'l';
    for (std::size_t k = 1; k < way.size(); ++k) {
      const long next_x = view.x(way[k].x_mm), next_y = view.y(way[k].y_mm);
      if (next_x == x && next_y == y) continue;
      // A minus sign separates numbers, as a space does.
      put(d, "{}{}{}{}", command, next_x - x, next_y < y ? "" : " ", next_y - y);
      command = ' ';
      x = next_x;
      y = next_y;
    }
    if (command == 'l') d += "h1";
    put(ends[group], "M{} {}h1", x, y);
  }
  const double robots = std::max(1.0, static_cast<double>(paths.robots() - run.cells()));
  const double width = std::clamp(24 - 5 * std::log10(robots), 3.5, 18.0);
  const double opacity = std::clamp(1.3 - 0.2 * std::log10(robots), 0.4, 0.95);
  const double dot =
      std::clamp(disc_units(view), 12.0, 80.0) * std::clamp(1.1 - 0.15 * std::log10(robots), 0.5, 1.0);
  std::string out = "<g fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\">\n";
  put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" d=\"{}\"/>\n", kStartDot, dot * 0.8, starts);
  for (std::size_t group = 0; group < ways.size(); ++group) {
    if (ways[group].empty()) continue;
    put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-opacity=\"{:.2f}\" d=\"{}\"/>\n", kByStart[group],
        width, opacity, ways[group]);
  }
  for (std::size_t group = 0; group < ends.size(); ++group) {
    if (ends[group].empty()) continue;
    put(out, "<path stroke=\"{}\" stroke-width=\"{:.1f}\" d=\"{}\"/>\n", kByStart[group], dot, ends[group]);
  }
  return out + "</g>\n";
}

/// The dashed outline of the region that another panel enlarges, on a light line that separates it from the paths below.
std::string draw_frame(const View& view, const Box& box) {
  std::string out;
  for (const auto& [colour, width, dashes] :
       {std::tuple{svg::kPaper, 40, ""}, {svg::kInk, 16, " stroke-dasharray=\"60 40\""}}) {
    put(out,
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n",
        view.x(box.x_min_mm), view.y(box.y_max_mm), view.x(box.x_max_mm) - view.x(box.x_min_mm),
        view.y(box.y_min_mm) - view.y(box.y_max_mm), colour, width, dashes);
  }
  return out;
}

/// The legend of failed robots and of LED colours, the most frequent first, as many as fit.
std::string led_legend(const Snapshot& at, const std::vector<double>& cell_mm, double x, double y,
                       double width_px) {
  std::map<std::uint8_t, std::size_t> counts;
  std::size_t failures = 0;
  for (std::size_t i = 0; i < at.led.size(); ++i) {
    if (!cell_mm.empty() && cell_mm[i] > 0) continue;
    ++counts[at.led[i] & 63];
    if (failed(at, i)) ++failures;
  }
  std::vector<std::pair<std::uint8_t, std::size_t>> order(counts.begin(), counts.end());
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string out;
  const double end = x + width_px;
  const auto entry = [&](std::string_view fill, std::string_view rim, const std::string& label) {
    const double width = 14 + svg::text_width_px(label, kCaption_px);
    if (x + width > end + 16) return false;
    put(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.4\"/>\n",
        x + 5, y - 4, fill, rim);
    out += svg::text(x + 14, y, kCaption_px, label, svg::kFaint);
    x += width + 10;
    return true;
  };
  if (failures > 0) entry("none", kFailedRim, fmt::format("failed {}", failures));
  out += svg::text(x, y, kCaption_px, "LED", svg::kFaint);
  x += 30;
  for (const auto& [led, count] : order) {
    if (!entry(svg::led_colour(led), svg::kInk, fmt::format("{} {}", svg::led_name(led), count))) break;
  }
  return out;
}

/// The legend of the panel of paths.
std::string path_legend(double x, double y) {
  std::string out =
      fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n", x + 5, y - 4, kStartDot);
  out += svg::text(x + 14, y, kCaption_px, "start", svg::kFaint);
  x += 62;
  for (const std::string_view colour : kByStart) {
    put(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n", x, y - 4, colour);
    x += 10;
  }
  return out + svg::text(x, y, kCaption_px, "end, coloured by x at the start", svg::kFaint);
}

/// A drawing in a frame: title and time above it, scale bar and remark below.
struct Panel {
  std::string title, when, drawing, remark;
};

std::string draw_panel(const Panel& panel, const View& view, double x, double y) {
  const double width = view.width_px(), height = view.height_px(), top = y + kPanelTitle_px,
               below = top + height + 18;
  std::string out = svg::text(x, y + 16, 15, panel.title, svg::kInk, svg::Anchor::kStart, true);
  out += svg::text(x + width, y + 16, 13, panel.when, svg::kFaint, svg::Anchor::kEnd);
  put(out, "<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" viewBox=\"0 0 {:.0f} {:.0f}\" ", x,
      top, width, height, kUnitsPerPx * width, kUnitsPerPx * height);
  put(out, "overflow=\"hidden\">\n<rect width=\"100%\" height=\"100%\" fill=\"#eef1f4\"/>\n{}</svg>\n",
      panel.drawing);
  put(out, "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"{}\"/>\n", x,
      top, width, height, svg::kLine);
  out += scale_bar(view, x + 1, below - 4);
  return out + svg::text(x + width, below, kCaption_px, panel.remark, svg::kFaint, svg::Anchor::kEnd);
}

}  // namespace

std::string picture_svg(const RunOverview& run) {
  const Paths& paths = run.paths;
  const Ground ground(run);
  const auto floor = [&](const View& of, const Snapshot& at) {
    return ground.draw_floor(of, &at == &paths.first() ? run.first_floors : run.last_floors) +
           ground.draw_obstacles(of) + ground.draw_movables(of, at);
  };
  const Box whole = ground.arena(), shown = zoomed(ground.content(), whole), start = extent(paths.first());
  Box at_start = start;
  add_movables(at_start, ground.world(), paths.first());

  const bool stacked = shown.width_mm() > 2.2 * shown.height_mm();  // wide ones lie one below the other
  const double width_px = stacked ? 900 : 384;
  const double ratio = shown.height_mm() / shown.width_mm();
  const double height_px = std::clamp(width_px * ratio, stacked ? 110.0 : 200.0, 560.0);
  const Box shown_at_start =
      moved_into(fitted(zoomed(at_start, shown), width_px, height_px), fitted(shown, width_px, height_px));
  const View view(shown, width_px, height_px), start_view(shown_at_start, width_px, height_px);
  const double enlarged = start_view.px_per_mm() / view.px_per_mm();
  const std::string part =
      View(whole, width_px, height_px).px_per_mm() < 0.95 * view.px_per_mm() ? "part of the arena" : "";
  const bool large_discs = disc_units(view) > 1.01 * view.length(2 * kRobotRadius_mm);
  const std::string from = time_text(paths.first().time_s), to = time_text(paths.last().time_s);

  const Panel start_panel{
      "Start", from,
      floor(start_view, paths.first()) + draw_robots(paths.first(), run.cell_mm, start_view) +
          ground.draw_lamps(start_view, paths.first().time_s),
      enlarged > 1.05 ? fmt::format("enlarged {:.1f} times, see dashed frame", enlarged) : part};
  const Panel paths_panel{"Paths", fmt::format("{} to {}", from, to),
                          floor(view, paths.last()) + draw_paths(run, view, start) +
                              (enlarged > 1.05 ? draw_frame(view, shown_at_start) : ""),
                          part};
  const Panel end_panel{"End", to,
                        floor(view, paths.last()) + draw_robots(paths.last(), run.cell_mm, view) +
                            ground.draw_lamps(view, paths.last().time_s),
                        large_discs ? "discs drawn larger than robots" : part};

  const double panel_height = kPanelTitle_px + height_px + kPanelFoot_px;
  const double step_x = stacked ? 0 : width_px + kGap_px, step_y = stacked ? panel_height : 0;
  const double top = kMargin_px + kTitle_px, foot = kPanelTitle_px + height_px + 38;
  const std::string name = title_of(run), facts = facts_of(run, ground.world());
  std::string body = svg::text(kMargin_px, kMargin_px + 16, 22, name, svg::kInk, svg::Anchor::kStart, true);
  body += svg::text(kMargin_px, kMargin_px + 38, 14, facts, svg::kFaint);
  double x = kMargin_px, y = top;
  body += draw_panel(start_panel, start_view, x, y) + led_legend(paths.first(), run.cell_mm, x, y + foot, width_px);
  x += step_x, y += step_y;
  body += draw_panel(paths_panel, view, x, y) + path_legend(x, y + foot);
  x += step_x, y += step_y;
  body += draw_panel(end_panel, view, x, y) + led_legend(paths.last(), run.cell_mm, x, y + foot, width_px);
  return svg::document(x + width_px + kMargin_px, y + panel_height + 6, name,
                       facts + ". Three panels: start, paths and end of all robots.", body);
}

}  // namespace kilotwin::recorder

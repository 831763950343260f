#include "clients/recorder/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "clients/recorder/axis.hpp"
#include "clients/recorder/paths.hpp"
#include "clients/recorder/svg.hpp"
#include "core/base/error.hpp"
#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "core/os/files.hpp"
#include "core/plan/from_manifest.hpp"
#include "core/plan/world.hpp"
#include "core/senses/light_source.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kMargin_px = 28, kGap_px = 26, kTitle_px = 56, kPanelTitle_px = 26, kPanelFoot_px = 48;
constexpr double kCaption_px = 12;
/// Number of positions kept for the paths of all robots together.
constexpr std::size_t kPathPoints = 160'000;
/// Drawings inside a panel have integer coordinates in tenths of a pixel, which keeps them short.
constexpr double kUnitsPerPx = 10;
/// Least diameter of a drawn disc.
constexpr double kLeastDisc_px = 1.8;

constexpr std::string_view kFailedRim = "#d0021b", kStartDot = "#b4bcc6", kLamp = "#f5a623";
/// Colours of paths and ends by the robot's x at the start, from left to right.
constexpr std::array<std::string_view, 6> kByStart = {"#2b4c9b", "#2387b5", "#2aa58a",
                                                      "#d9a21b", "#e0702a", "#b8336a"};

struct Box {
  double x_min_mm = 1e300, y_min_mm = 1e300, x_max_mm = -1e300, y_max_mm = -1e300;
  void add(double x, double y) {
    x_min_mm = std::min(x_min_mm, x);
    x_max_mm = std::max(x_max_mm, x);
    y_min_mm = std::min(y_min_mm, y);
    y_max_mm = std::max(y_max_mm, y);
  }
  [[nodiscard]] Box widened(double by_mm) const {
    return {x_min_mm - by_mm, y_min_mm - by_mm, x_max_mm + by_mm, y_max_mm + by_mm};
  }
  [[nodiscard]] double width_mm() const { return x_max_mm - x_min_mm; }
  [[nodiscard]] double height_mm() const { return y_max_mm - y_min_mm; }
};

/// Maps a part of the arena to a panel of width x height px. y points up in the arena and down on paper.
class View {
 public:
  View(const Box& box, double width_px, double height_px)
      : width_px_(width_px),
        height_px_(height_px),
        px_per_mm_(std::min(width_px / box.width_mm(), height_px / box.height_mm())),
        x_mm_((box.x_min_mm + box.x_max_mm) / 2),
        y_mm_((box.y_min_mm + box.y_max_mm) / 2) {}
  [[nodiscard]] double px_per_mm() const { return px_per_mm_; }
  [[nodiscard]] long x(double x_mm) const {
    return std::lround(kUnitsPerPx * (width_px_ / 2 + (x_mm - x_mm_) * px_per_mm_));
  }
  [[nodiscard]] long y(double y_mm) const {
    return std::lround(kUnitsPerPx * (height_px_ / 2 - (y_mm - y_mm_) * px_per_mm_));
  }
  [[nodiscard]] double length(double mm) const { return kUnitsPerPx * mm * px_per_mm_; }
  [[nodiscard]] double width_px() const { return width_px_; }
  [[nodiscard]] double height_px() const { return height_px_; }

 private:
  double width_px_, height_px_, px_per_mm_, x_mm_, y_mm_;
};

template <class... Arguments>
void put(std::string& out, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Arguments>(arguments)...);
}

/// "30 s", "59.97 s", "1200 s": two decimals, without trailing zeros.
std::string time_text(double time_s) { return fmt::format("{:g} s", std::round(time_s * 100) / 100); }

bool failed(const Snapshot& at, std::size_t robot) {
  return at.life_cycle[robot] == static_cast<std::uint8_t>(LifeCycle::kFailed);
}

double disc_units(const View& view) {
  return std::max(view.length(2 * kRobotRadius_mm), kUnitsPerPx * kLeastDisc_px);
}

/// Robots as discs in their LED's colour with a tick towards the heading; failed robots have a red rim. A disc is a line of
/// length 0 with round caps, as thick as the disc: ten bytes.
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

/// Paths of all robots. Colours follow x at the start, which makes mixing visible.
std::string draw_paths(const Paths& paths, const View& view, const Box& start) {
  std::array<std::string, kByStart.size()> ways, ends;
  std::string starts;
  const Snapshot& first = paths.first();
  for (std::size_t i = 0; i < paths.robots(); ++i) {
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
  const double robots = static_cast<double>(paths.robots());
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

std::string outline(const View& view, const std::vector<Point2>& corners) {
  std::string d;
  for (const Point2 corner : corners)
    put(d, "{}{} {}", d.empty() ? 'M' : 'L', view.x(corner.x_mm), view.y(corner.y_mm));
  return d + "Z";
}

std::string draw_shape(const View& view, const Convex& shape, const Place& place, std::string_view style) {
  if (shape.is_disc()) {
    return fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{:.1f}\" {}/>\n", view.x(place.x_mm), view.y(place.y_mm),
                       view.length(shape.radius_mm()), style);
  }
  std::vector<Point2> corners;
  for (const Point2 corner : shape.corners()) corners.push_back(place.to_arena(corner));
  return fmt::format("<path d=\"{}\" {}/>\n", outline(view, corners), style);
}

/// Obstacles, and movable bodies with their poses in this state.
std::string draw_bodies(const World& world, const Snapshot& at, const View& view) {
  std::string out;
  for (const ObstacleBody& body : world.obstacles)
    out += draw_shape(view, body.shape, body.place, "fill=\"#8b95a1\" stroke=\"#2b3440\" stroke-width=\"10\"");
  for (std::size_t i = 0; i < world.movables.size(); ++i) {
    const Place place = Place::at(at.movable_x_mm[i], at.movable_y_mm[i], at.movable_heading_rad[i]);
    out +=
        draw_shape(view, world.movables[i].shape, place, "fill=\"#e9d8b4\" stroke=\"#8a6d3b\" stroke-width=\"14\"");
  }
  return out;
}

/// Walls of an arena that is not a rectangle. The ground inside has another colour than outside.
std::string draw_walls(const View& view, const ArenaShape& arena) {
  const std::string style = fmt::format("fill=\"#fbfcfd\" stroke=\"{}\" stroke-width=\"16\"", svg::kInk);
  if (arena.kind() == ArenaShape::Kind::kCircle)
    return draw_shape(view, Convex::disc(arena.radius_mm()), {}, style);
  return fmt::format("<path d=\"{}\" {}/>\n", outline(view, arena.corners()), style);
}

/// The arena's walls within the view. The ground inside has another colour than outside.
std::string draw_arena(const View& view, const World& world, double width_mm, double height_mm) {
  if (world.arena.kind() != ArenaShape::Kind::kRectangle) return draw_walls(view, world.arena);
  const auto clipped = [](long value, double px) {
    return std::clamp(value, -100L, static_cast<long>(kUnitsPerPx * px) + 100L);
  };
  const long left = clipped(view.x(-width_mm / 2), view.width_px()),
             right = clipped(view.x(width_mm / 2), view.width_px());
  const long top = clipped(view.y(height_mm / 2), view.height_px()),
             bottom = clipped(view.y(-height_mm / 2), view.height_px());
  return fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#fbfcfd\" stroke=\"{}\" stroke-width=\"16\"/>\n",
      left, top, right - left, bottom - top, svg::kInk);
}

/// A circle of a virtual environment: food, home, a hub.
struct VirtualCircle {
  double x_mm, y_mm, radius_mm;
  std::string_view name, fill, stroke;
};

std::vector<VirtualCircle> virtual_circles(const proto::RecordingHeader& header) {
  std::vector<VirtualCircle> circles;
  for (const proto::VirtualEnvironment& environment : header.environment()) {
    if (environment.has_hub()) {
      const proto::HubEnvironment& hub = environment.hub();
      circles.push_back({hub.x_mm(), hub.y_mm(), hub.radius_mm(), "hub", "#e3ecf7", "#2563a8"});
    }
    if (environment.has_foraging()) {
      const proto::ForagingEnvironment& foraging = environment.foraging();
      circles.push_back(
          {foraging.food_x_mm(), foraging.food_y_mm(), foraging.food_radius_mm(), "food", "#f6ecd2", "#b8860b"});
      circles.push_back(
          {foraging.home_x_mm(), foraging.home_y_mm(), foraging.home_radius_mm(), "home", "#dff0e6", "#2a8f5b"});
    }
  }
  return circles;
}

/// Circles at the start of the run: later the food shrinks and the home grows with every load.
std::string draw_circles(const std::vector<VirtualCircle>& circles, const View& view) {
  constexpr double kText = 130;
  std::string out;
  for (const VirtualCircle& circle : circles) {
    const long x = view.x(circle.x_mm), y = view.y(circle.y_mm);
    const double radius = view.length(circle.radius_mm);
    put(out,
        "<circle cx=\"{}\" cy=\"{}\" r=\"{:.1f}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"14\" "
        "stroke-dasharray=\"50 30\"/>\n",
        x, y, radius, circle.fill, circle.stroke);
    // The name stands above the circle, or inside it at the panel's edge.
    const double above = static_cast<double>(y) - radius - 40;
    out += svg::text(static_cast<double>(x), above > kText ? above : static_cast<double>(y) - radius + 1.2 * kText,
                     kText, circle.name, circle.stroke, svg::Anchor::kMiddle);
  }
  return out;
}

/// What virtual environments have painted, by environment.
using Floors = std::map<std::uint32_t, proto::FloorRecord>;

struct FirstAndLastFloors {
  Floors first, last;
};

/// In a pass of its own over the recording.
FirstAndLastFloors floors_of(const std::filesystem::path& recording) {
  FirstAndLastFloors floors;
  Reader reader(recording);
  while (const proto::Record* const record = reader.next()) {
    if (!record->has_floor()) continue;
    floors.first.try_emplace(record->floor().environment(), record->floor());
    floors.last[record->floor().environment()] = record->floor();
  }
  return floors;
}

std::string fill_of(const std::string& rgba, std::size_t index) {
  const auto octet = [&](std::size_t k) {
    return static_cast<unsigned>(static_cast<unsigned char>(rgba[4 * index + k]));
  };
  return fmt::format("fill=\"#{:02x}{:02x}{:02x}\" fill-opacity=\"{:.2f}\"", octet(0), octet(1), octet(2),
                     octet(3) / 255.0);
}

/// The raster cell by cell, without transparent cells; then the circles with their names.
std::string draw_floor(const proto::FloorRecord& floor, const View& view, double width_mm, double height_mm) {
  constexpr double kText = 130;
  std::string out;
  const std::size_t cells = std::size_t{floor.columns()} * floor.rows();
  for (std::size_t i = 0; i < cells; ++i) {
    if (floor.rgba()[4 * i + 3] == 0) continue;
    const double x_mm = (static_cast<double>(i % floor.columns()) / floor.columns() - 0.5) * width_mm;
    const double y_mm = (0.5 - static_cast<double>(i / floor.columns()) / floor.rows()) * height_mm;
    const long x = view.x(x_mm), y = view.y(y_mm);
    put(out, "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}/>\n", x, y,
        view.x(x_mm + width_mm / floor.columns()) - x, view.y(y_mm - height_mm / floor.rows()) - y,
        fill_of(floor.rgba(), i));
  }
  const int circles = floor.circle_name_size();
  for (int i = 0; i < circles; ++i) {
    const double radius = view.length(floor.circle_mm(3 * i + 2));
    const long x = view.x(floor.circle_mm(3 * i)), y = view.y(floor.circle_mm(3 * i + 1));
    put(out, "<circle cx=\"{}\" cy=\"{}\" r=\"{:.1f}\" {} stroke=\"{}\" stroke-width=\"14\"/>\n", x, y, radius,
        fill_of(floor.circle_rgba(), static_cast<std::size_t>(i)), svg::kFaint);
    out += svg::text(static_cast<double>(x), static_cast<double>(y) - radius - 40, kText,
                     svg::shortened(floor.circle_name(i), 20), svg::kFaint, svg::Anchor::kMiddle);
  }
  return out;
}

/// The lamps at a given time as suns; hollow if they are off.
std::string draw_lamps(const proto::Light& light, double time_s, const View& view) {
  constexpr double kRadius = 55, kRay = 100;
  std::string out;
  for (const proto::LightSource& source : light.source()) {
    const senses::Lamp lamp = senses::lamp_at(settings_of(source), time_s);
    const auto x = static_cast<double>(view.x(lamp.x_mm)), y = static_cast<double>(view.y(lamp.y_mm));
    std::string rays;
    for (int i = 0; i < 8; ++i) {
      const double c = std::cos(i * kPi / 4), s = std::sin(i * kPi / 4);
      put(rays, "M{:.0f} {:.0f}L{:.0f} {:.0f}", x + 1.3 * kRadius * c, y + 1.3 * kRadius * s, x + kRay * c,
          y + kRay * s);
    }
    put(out, "<circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"{:.0f}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"12\"/>\n",
        x, y, kRadius, lamp.intensity > 0 ? kLamp : std::string_view("none"), kLamp);
    put(out, "<path d=\"{}\" stroke=\"{}\" stroke-width=\"16\"/>\n", rays, kLamp);
  }
  return out;
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

std::string scale_bar(const View& view, double x, double y) {
  const double length_mm = round_step(view.width_px() / view.px_per_mm(), 10);
  const double length_px = length_mm * view.px_per_mm();
  std::string out = fmt::format(
      "<path d=\"M{0:.1f} {1:.1f}v6M{0:.1f} {2:.1f}h{3:.1f}M{4:.1f} {1:.1f}v6\" fill=\"none\" stroke=\"{5}\" "
      "stroke-width=\"1.6\"/>\n",
      x, y - 3, y, length_px, x + length_px, svg::kInk);
  return out + svg::text(x + length_px + 8, y + 4, kCaption_px, fmt::format("{:g} mm", length_mm));
}

/// The legend of failed robots and of LED colours, the most frequent first, as many as fit.
std::string led_legend(const Snapshot& at, double x, double y, double width_px) {
  std::map<std::uint8_t, std::size_t> counts;
  std::size_t failures = 0;
  for (std::size_t i = 0; i < at.led.size(); ++i) {
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

Box extent(const Snapshot& at) {
  Box box;
  for (std::size_t i = 0; i < at.x_mm.size(); ++i) box.add(at.x_mm[i], at.y_mm[i]);
  return box;
}

/// `box` widened to the aspect ratio of a panel, so that the panel shows exactly this box.
Box fitted(const Box& box, double width_px, double height_px) {
  const double px_per_mm = std::min(width_px / box.width_mm(), height_px / box.height_mm());
  const double wider_mm = width_px / px_per_mm - box.width_mm(),
               higher_mm = height_px / px_per_mm - box.height_mm();
  return {box.x_min_mm - wider_mm / 2, box.y_min_mm - higher_mm / 2, box.x_max_mm + wider_mm / 2,
          box.y_max_mm + higher_mm / 2};
}

/// `box` moved into `outer`, which is at least as large.
Box moved_into(const Box& box, const Box& outer) {
  const auto shift = [](double low, double high, double outer_low, double outer_high) {
    return low < outer_low ? outer_low - low : high > outer_high ? outer_high - high : 0.0;
  };
  const double x = shift(box.x_min_mm, box.x_max_mm, outer.x_min_mm, outer.x_max_mm);
  const double y = shift(box.y_min_mm, box.y_max_mm, outer.y_min_mm, outer.y_max_mm);
  return {box.x_min_mm + x, box.y_min_mm + y, box.x_max_mm + x, box.y_max_mm + y};
}

/// Extends the box by whole movable bodies, in any orientation.
void add_movables(Box& box, const World& world, const Snapshot& at) {
  for (std::size_t i = 0; i < world.movables.size(); ++i) {
    const double reach_mm = world.movables[i].shape.reach_mm();
    for (const double way_mm : {-reach_mm, reach_mm})
      box.add(at.movable_x_mm[i] + way_mm, at.movable_y_mm[i] + way_mm);
  }
}

/// `inner` with a margin if it is much smaller than `outer`, otherwise `outer`.
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

}  // namespace

std::string picture_svg(Reader& recording) {
  const Paths paths(recording, kPathPoints);
  if (paths.empty()) {
    throw UserError(
        fmt::format("{}: no state to draw; the run ended before its first one", recording.path().string()));
  }
  const proto::RecordingHeader& header = recording.header();
  const double arena_width = header.arena_width_mm(), arena_height = header.arena_height_mm();
  proto::Experiment stated;
  *stated.mutable_arena() = header.arena();
  *stated.mutable_obstacle() = header.obstacle();
  *stated.mutable_movable() = header.movable();
  const World world(stated);
  const FirstAndLastFloors floors = floors_of(recording.path());
  std::vector<VirtualCircle> circles;
  if (floors.last.empty()) circles = virtual_circles(header);
  const auto ground = [&](const View& of, const Snapshot& at) {
    std::string out = draw_arena(of, world, arena_width, arena_height) + draw_circles(circles, of);
    for (const auto& [environment, floor] : &at == &paths.first() ? floors.first : floors.last)
      out += draw_floor(floor, of, arena_width, arena_height);
    return out + draw_bodies(world, at, of);
  };
  Box everything;
  for (std::size_t i = 0; i < paths.robots(); ++i) {
    for (const Point& p : paths.path(i)) everything.add(p.x_mm, p.y_mm);
  }
  for (const Snapshot* at : {&paths.first(), &paths.last()}) add_movables(everything, world, *at);
  for (const VirtualCircle& circle : circles) {
    everything.add(circle.x_mm - circle.radius_mm, circle.y_mm - circle.radius_mm);
    everything.add(circle.x_mm + circle.radius_mm, circle.y_mm + circle.radius_mm);
  }
  const Box arena = Box{-arena_width / 2, -arena_height / 2, arena_width / 2, arena_height / 2};
  const Box whole = arena.widened(0.01 * std::max(arena_width, arena_height));
  const Box shown = zoomed(everything, whole);
  const Box start = extent(paths.first());
  Box at_start = start;
  add_movables(at_start, world, paths.first());

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
      ground(start_view, paths.first()) + draw_discs(paths.first(), start_view) +
          draw_lamps(header.light(), paths.first().time_s, start_view),
      enlarged > 1.05 ? fmt::format("enlarged {:.1f} times, see dashed frame", enlarged) : part};
  const Panel paths_panel{"Paths", fmt::format("{} to {}", from, to),
                          ground(view, paths.last()) + draw_paths(paths, view, start) +
                              (enlarged > 1.05 ? draw_frame(view, shown_at_start) : ""),
                          part};
  const Panel end_panel{"End", to,
                        ground(view, paths.last()) + draw_discs(paths.last(), view) +
                            draw_lamps(header.light(), paths.last().time_s, view),
                        large_discs ? "discs drawn larger than robots" : part};

  const double panel_height = kPanelTitle_px + height_px + kPanelFoot_px;
  const double step_x = stacked ? 0 : width_px + kGap_px, step_y = stacked ? panel_height : 0;
  const double top = kMargin_px + kTitle_px, foot = kPanelTitle_px + height_px + 38;
  const std::string name = svg::shortened(header.name().empty() ? "Kilotwin run" : header.name(), 60);
  const std::string facts = fmt::format("{} robot{} \u00b7 seed {} \u00b7 {} simulated \u00b7 arena {}",
                                        header.robots(), header.robots() == 1 ? "" : "s", header.seed(), to,
                                        world.arena.kind() == ArenaShape::Kind::kRectangle
                                            ? fmt::format("{:g} mm \u00d7 {:g} mm", arena_width, arena_height)
                                            : world.arena.described());
  std::string body = svg::text(kMargin_px, kMargin_px + 16, 22, name, svg::kInk, svg::Anchor::kStart, true);
  body += svg::text(kMargin_px, kMargin_px + 38, 14, facts, svg::kFaint);
  double x = kMargin_px, y = top;
  body += draw_panel(start_panel, start_view, x, y) + led_legend(paths.first(), x, y + foot, width_px);
  x += step_x, y += step_y;
  body += draw_panel(paths_panel, view, x, y) + path_legend(x, y + foot);
  x += step_x, y += step_y;
  body += draw_panel(end_panel, view, x, y) + led_legend(paths.last(), x, y + foot, width_px);
  return svg::document(x + width_px + kMargin_px, y + panel_height + 6, name,
                       facts + ". Three panels: start, paths and end of all robots.", body);
}

void write_picture(Reader& recording, const std::filesystem::path& file) {
  os::write_file(file, picture_svg(recording));
}

}  // namespace kilotwin::recorder

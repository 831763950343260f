#include "clients/recorder/ground.hpp"

#include <algorithm>
#include <cmath>

#include "clients/recorder/svg.hpp"
#include "core/base/pose.hpp"
#include "core/plan/from_manifest.hpp"
#include "core/senses/light_source.hpp"

namespace kilotwin::recorder {
namespace {

constexpr std::string_view kLamp = "#f5a623";

World world_of(const proto::RecordingHeader& header) {
  proto::Experiment stated;
  *stated.mutable_arena() = header.arena();
  *stated.mutable_obstacle() = header.obstacle();
  *stated.mutable_movable() = header.movable();
  return World(stated);
}

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

std::string fill_of(const std::string& rgba, std::size_t index) {
  const auto octet = [&](std::size_t k) {
    return static_cast<unsigned>(static_cast<unsigned char>(rgba[4 * index + k]));
  };
  return fmt::format("fill=\"#{:02x}{:02x}{:02x}\" fill-opacity=\"{:.2f}\"", octet(0), octet(1), octet(2),
                     octet(3) / 255.0);
}

/// The raster cell by cell, without transparent cells; then the circles with their names.
std::string draw_painted(const proto::FloorRecord& floor, const View& view, double width_mm, double height_mm) {
  constexpr double kText = 130;
  std::string out;
  const std::size_t cells = std::size_t{floor.columns()} * floor.rows();
  for (std::size_t i = 0; i < cells; ++i) {
    if (floor.rgba()[4 * i + 3] == 0) continue;
    const std::size_t column = i % floor.columns(), row = i / floor.columns();
    const double x_mm = (static_cast<double>(column) / floor.columns() - 0.5) * width_mm;
    const double y_mm = (0.5 - static_cast<double>(row) / floor.rows()) * height_mm;
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

}  // namespace

std::string title_of(const RunOverview& run) {
  return svg::shortened(run.header.name().empty() ? "Kilotwin run" : run.header.name(), 60);
}

std::string facts_of(const RunOverview& run, const World& world) {
  const proto::RecordingHeader& header = run.header;
  const std::uint32_t cells = run.cells(), robots = header.robots() - cells;
  return fmt::format("{} robot{}{} \u00b7 seed {} \u00b7 {} simulated \u00b7 arena {}", robots,
                     robots == 1 ? "" : "s", cells > 0 ? fmt::format(" \u00b7 {} cells", cells) : "", header.seed(),
                     time_text(run.paths.last().time_s),
                     world.arena.kind() == ArenaShape::Kind::kRectangle
                         ? fmt::format("{:g} mm \u00d7 {:g} mm", header.arena_width_mm(), header.arena_height_mm())
                         : world.arena.described());
}

Ground::Ground(const RunOverview& run) : run_(run), world_(world_of(run.header)) {
  if (run.last_floors.empty()) circles_ = virtual_circles(run.header);
}

Box Ground::arena() const {
  const double width = run_.header.arena_width_mm(), height = run_.header.arena_height_mm();
  return Box{-width / 2, -height / 2, width / 2, height / 2}.widened(0.01 * std::max(width, height));
}

Box Ground::content() const {
  Box box;
  for (std::size_t i = 0; i < run_.paths.robots(); ++i) {
    for (const Point& p : run_.paths.path(i)) box.add(p.x_mm, p.y_mm);
  }
  for (const Snapshot* at : {&run_.paths.first(), &run_.paths.last()}) add_movables(box, world_, *at);
  for (const VirtualCircle& circle : circles_) {
    box.add(circle.x_mm - circle.radius_mm, circle.y_mm - circle.radius_mm);
    box.add(circle.x_mm + circle.radius_mm, circle.y_mm + circle.radius_mm);
  }
  return box;
}

std::string Ground::draw_floor(const View& view, const Floors& floors) const {
  const double width = run_.header.arena_width_mm(), height = run_.header.arena_height_mm();
  std::string out = draw_arena(view, world_, width, height) + draw_circles(circles_, view);
  for (const auto& [environment, floor] : floors) out += draw_painted(floor, view, width, height);
  return out;
}

std::string Ground::draw_obstacles(const View& view) const {
  std::string out;
  for (const ObstacleBody& body : world_.obstacles)
    out += draw_shape(view, body.shape, body.place, "fill=\"#8b95a1\" stroke=\"#2b3440\" stroke-width=\"10\"");
  return out;
}

std::string Ground::draw_movable(std::size_t body, const View& view, const Place& place) const {
  return draw_shape(view, world_.movables[body].shape, place,
                    "fill=\"#e9d8b4\" stroke=\"#8a6d3b\" stroke-width=\"14\"");
}

std::string Ground::draw_movables(const View& view, const Snapshot& at) const {
  std::string out;
  for (std::size_t i = 0; i < world_.movables.size(); ++i)
    out += draw_movable(i, view, Place::at(at.movable_x_mm[i], at.movable_y_mm[i], at.movable_heading_rad[i]));
  return out;
}

std::string Ground::draw_lamps(const View& view, double time_s) const {
  constexpr double kRadius = 55, kRay = 100;
  std::string out;
  for (const proto::LightSource& source : run_.header.light().source()) {
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

}  // namespace kilotwin::recorder

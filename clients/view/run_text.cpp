#include "clients/view/run_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/base64.hpp"
#include "core/base/pose.hpp"
#include "core/plan/world.hpp"
#include "idl/experiment.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin::view {
namespace {

using nlohmann::json;

/// Bytes that are no UTF-8 become replacement characters.
std::string text_of(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

json corners_of(const std::vector<Point2>& corners) {
  json list = json::array();
  for (const Point2 corner : corners) list.push_back({corner.x_mm, corner.y_mm});
  return list;
}

json shape_of_body(const Convex& shape) {
  if (shape.is_disc()) return {{"radius", shape.radius_mm()}};
  return {{"corners", corners_of(shape.corners())}};
}

json arena_of(const ArenaShape& arena) {
  json text{{"halfWidth", arena.half_width_mm()}, {"halfHeight", arena.half_height_mm()}};
  if (arena.kind() == ArenaShape::Kind::kCircle) text["radius"] = arena.radius_mm();
  if (arena.kind() == ArenaShape::Kind::kPolygon) text["corners"] = corners_of(arena.corners());
  return text;
}

json obstacles_of(const World& world) {
  json list = json::array();
  for (const ObstacleBody& body : world.obstacles) {
    json one = shape_of_body(body.shape);
    one["pose"] = {body.place.x_mm, body.place.y_mm, body.heading_rad};
    list.push_back(std::move(one));
  }
  return list;
}

json movables_of(const World& world) {
  json list = json::array();
  for (const MovableBodyModel& body : world.movables) list.push_back(shape_of_body(body.shape));
  return list;
}

const char* kind_of(const proto::RobotGroup& group, bool firmware) {
  if (group.body() == proto::RobotGroup::TRACKED) return "tracked";
  return firmware ? "firmware" : "native";
}

json groups_of(const RunOutline& outline, const proto::Experiment& experiment) {
  json list = json::array();
  std::uint64_t first = 0;
  for (int i = 0; i < experiment.robots_size(); ++i) {
    const proto::RobotGroup& group = experiment.robots(i);
    const auto number = static_cast<std::size_t>(i);
    const bool firmware = group.avr() || (number < outline.firmware.size() && outline.firmware[number]);
    list.push_back({{"first", first},
                    {"count", group.count()},
                    {"kind", kind_of(group, firmware)},
                    {"immobile", group.immobile()},
                    {"program", group.behaviour_size() > 0 ? group.behaviour(0) : ""}});
    first += group.count();
  }
  return list;
}

/// Columns and rows of equal size over the rectangle around the arena, as PartitionGrid divides it.
json partitions_of(const RunOutline& outline, const proto::Experiment& experiment) {
  if (!outline.federated) return {1, 1};
  return {experiment.deployment().partition_columns(), experiment.deployment().partition_rows()};
}

bool records(const proto::Experiment& experiment, proto::RecordedEvent kind) {
  const auto& kinds = experiment.recording().event();
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

/// Circles of the environments that Kilotwin brings: food, home, a hub.
json circles_of(const proto::Experiment& experiment) {
  json list = json::array();
  const auto add = [&list](double x, double y, double radius, const char* name) {
    list.push_back({{"x", x}, {"y", y}, {"radius", radius}, {"name", name}});
  };
  for (const proto::VirtualEnvironment& environment : experiment.station().environment()) {
    if (environment.has_hub()) {
      const proto::HubEnvironment& hub = environment.hub();
      add(hub.x_mm(), hub.y_mm(), hub.radius_mm(), "hub");
    }
    if (environment.has_foraging()) {
      const proto::ForagingEnvironment& foraging = environment.foraging();
      add(foraging.food_x_mm(), foraging.food_y_mm(), foraging.food_radius_mm(), "food");
      add(foraging.home_x_mm(), foraging.home_y_mm(), foraging.home_radius_mm(), "home");
    }
  }
  return list;
}

json floor_of(const proto::FloorRecord& floor) {
  json circles = json::array();
  for (int i = 0; i < floor.circle_name_size(); ++i) {
    circles.push_back(
        {{"x", floor.circle_mm(3 * i)},
         {"y", floor.circle_mm(3 * i + 1)},
         {"radius", floor.circle_mm(3 * i + 2)},
         {"rgba", base64(floor.circle_rgba().substr(std::size_t{4} * static_cast<std::size_t>(i), 4))},
         {"name", floor.circle_name(i)}});
  }
  return {
      {"columns", floor.columns()}, {"rows", floor.rows()}, {"rgba", base64(floor.rgba())}, {"circles", circles}};
}

}  // namespace

std::string run_text(const RunOutline& outline, const proto::Experiment& experiment) {
  const World world(experiment);
  const PositionGrid grid = grid_of(experiment);
  return text_of({{"type", "run"},
                  {"source", outline.live ? "live" : "recorded"},
                  {"name", outline.name},
                  {"run", fmt::format("{:016x}", outline.run)},
                  {"seed", std::to_string(outline.seed)},
                  {"tickSeconds", outline.tick_s},
                  {"firstTick", outline.first_tick},
                  {"lastTick", outline.last_tick},
                  {"robots", outline.robots},
                  {"states", outline.states},
                  {"gridLowest", grid.lowest_mm},
                  {"gridStep", grid.step_mm},
                  {"robotRadius", kRobotRadius_mm},
                  {"radioRange", experiment.radio().range_mm()},
                  {"arena", arena_of(world.arena)},
                  {"obstacles", obstacles_of(world)},
                  {"movables", movables_of(world)},
                  {"light", experiment.has_light()},
                  {"circles", circles_of(experiment)},
                  {"partitions", partitions_of(outline, experiment)},
                  {"ghostMargin", outline.ghost_margin_mm},
                  {"sentRecorded", records(experiment, proto::SENT)},
                  {"receivedRecorded", records(experiment, proto::RECEIVED)},
                  {"groups", groups_of(outline, experiment)}});
}

PositionGrid grid_of(const proto::Experiment& experiment) {
  const ArenaShape arena(experiment.arena());
  return PositionGrid::over(arena.half_width_mm(), arena.half_height_mm());
}

std::string floors_text(const std::vector<proto::FloorRecord>& floors) {
  json list = json::array();
  for (const proto::FloorRecord& floor : floors) list.push_back(floor_of(floor));
  return text_of({{"type", "floors"}, {"floors", list}});
}

std::string trail_text(std::uint32_t robot, const std::vector<double>& xy_mm, bool whole) {
  return text_of({{"type", "trail"}, {"robot", robot}, {"whole", whole}, {"xy", xy_mm}});
}

std::string program_text(const ProgramText& program) {
  json variables = json::array();
  for (const auto& [name, value] : program.variables)
    variables.push_back({{"name", name}, {"value", value ? json(*value) : json(nullptr)}});
  return text_of({{"type", "program"},
                  {"robot", program.robot},
                  {"tick", program.tick},
                  {"known", program.known},
                  {"variables", variables},
                  {"log", program.log}});
}

std::string marks_text(const std::vector<Mark>& marks, bool whole) {
  json list = json::array();
  for (const Mark& mark : marks) list.push_back({{"tick", mark.tick}, {"text", mark.text}});
  return text_of({{"type", "marks"}, {"whole", whole}, {"marks", list}});
}

std::string notice_text(const std::string& line) { return refusal_text(line, /*places=*/false); }

std::string refusal_text(const std::string& line, bool places) {
  return text_of({{"type", "notice"}, {"text", line}, {"refuses", places ? "place" : ""}});
}

}  // namespace kilotwin::view

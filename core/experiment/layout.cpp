#include "core/experiment/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/experiment/field_checks.hpp"
#include "core/experiment/fields.hpp"
#include "core/experiment/limits.hpp"
#include "core/experiment/occupancy.hpp"
#include "core/experiment/poses_csv.hpp"
#include "core/math/elementary.h"
#include "core/plan/world.hpp"
#include "core/random/random.hpp"

namespace kilotwin {

namespace {

constexpr double kDiameter_mm = 2 * kRobotRadius_mm;
constexpr double kRadiansPerDegree = kPi / 180;
/// Draw numbers of Stream::kLayout per robot: trial i of random placement uses 2 i and 2 i + 1, the heading uses the last one.
constexpr std::uint32_t kMostTrials = 30'000, kHeadingDraw = 65'535;

/// Whether |at_mm| exceeds the limit by more than rounding errors.
bool beyond(double at_mm, double limit_mm) {
  return at_mm > limit_mm + kTouchTolerance_mm || at_mm < -limit_mm - kTouchTolerance_mm;
}

/// The robots of one group, while they are being placed.
struct Group {
  const proto::RobotGroup* spec;
  std::string path;  ///< path of the group in the experiment
  std::uint32_t first = 0, count = 0;
  CsvPoses csv;  ///< for a layout by poses
  std::string csv_name;
};

class Placement {
 public:
  explicit Placement(const LoadedExperiment& loaded)
      : loaded_(loaded), experiment_(loaded.experiment), random_(experiment_.seed()), world_(experiment_) {
    for (const MovableBodyModel& body : world_.movables) {
      movable_places_.push_back(Place::at(body.pose.x_mm, body.pose.y_mm, body.pose.heading_rad));
    }
  }
  PlacedRobots place();

 private:
  void measure();
  void place_grid(const Group& group);
  void place_rings(const Group& group);
  void place_poses(const Group& group);
  void place_random(const Group& group);
  void check_movables() const;
  void check_placed(Occupancy& occupancy, const Group& group) const;
  /// Cells of a Kilogrid have no bodies; their centres lie within the walls.
  void check_cells_within(const Group& group) const;
  /// The path of an obstacle or movable body that a disc overlaps by more than rounding errors, or "".
  [[nodiscard]] std::string body_within(double x_mm, double y_mm, double radius_mm) const;
  void set_heading(std::uint32_t robot, const proto::Layout& layout, proto::Heading heading, double heading_deg);
  void set_position(std::uint32_t robot, double x_mm, double y_mm) {
    placed_.x_mm[robot] = x_mm;
    placed_.y_mm[robot] = y_mm;
  }
  [[nodiscard]] UserError error_at(const Group& group, std::uint32_t robot, std::string_view text) const;
  [[nodiscard]] std::string described(std::uint32_t robot) const {
    const auto tenths = [](double at_mm) { return number_text(std::round(at_mm * 10) / 10 + 0.0); };
    return fmt::format("robot {} at ({}, {}) mm", robot, tenths(placed_.x_mm[robot]), tenths(placed_.y_mm[robot]));
  }

  const LoadedExperiment& loaded_;
  const proto::Experiment& experiment_;
  const Random random_;
  const World world_;
  std::vector<Place> movable_places_;
  std::vector<Group> groups_;
  PlacedRobots placed_;
};

/// Reads the files of poses and counts the robots of every group.
void Placement::measure() {
  std::uint64_t total = 0;
  for (int g = 0; g < experiment_.robots_size(); ++g) {
    Group group{&experiment_.robots(g), fmt::format("robots[{}]", g), 0, 0, {}, {}};
    std::uint64_t count = stated_count(*group.spec);
    if (group.spec->layout().has_poses()) {
      const std::filesystem::path file = loaded_.resolve(group.spec->layout().poses().csv());
      group.csv = read_poses_csv(file, loaded_.locations.where(group.path + ".layout.poses.csv"));
      group.csv_name = one_line(file.string());
      const auto rows = static_cast<std::uint32_t>(group.csv.line.size());
      if (group.spec->has_count() && group.spec->count() != rows) {
        throw loaded_.locations.error(group.path + ".count",
                                      fmt::format("count is {} but {} has {} poses; write {} or leave count out",
                                                  group.spec->count(), group.csv_name, rows, rows));
      }
      count = rows;
    }
    // check_total() below refuses totals that exceed 32 bits.
    group.first = static_cast<std::uint32_t>(total);
    group.count = static_cast<std::uint32_t>(count);
    total += count;
    placed_.group_count.push_back(group.count);
    groups_.push_back(std::move(group));
  }
  check_total(loaded_, total);
  placed_.x_mm.resize(total);
  placed_.y_mm.resize(total);
  placed_.heading_rad.resize(total);
}

UserError Placement::error_at(const Group& group, std::uint32_t robot, std::string_view text) const {
  if (!group.csv.line.empty()) {
    return UserError{fmt::format("{}:{}:1: {}", group.csv_name, group.csv.line[robot - group.first], text)};
  }
  const proto::Layout& layout = group.spec->layout();
  const char* const shape = layout.has_rings() ? ".rings" : layout.has_random() ? ".random" : ".grid";
  return loaded_.locations.error(group.path + ".layout" + shape, text);
}

void Placement::set_heading(std::uint32_t robot, const proto::Layout& layout, proto::Heading heading,
                            double heading_deg) {
  const double to_x_mm = layout.x_mm() - placed_.x_mm[robot], to_y_mm = layout.y_mm() - placed_.y_mm[robot];
  double angle_rad = 0;
  switch (heading) {
    case proto::HEADING_RANDOM:
      angle_rad = (2 * random_.uniform(Stream::kLayout, robot, Tick{0}, kHeadingDraw) - 1) * kPi;
      break;
    case proto::HEADING_FIXED: angle_rad = heading_deg * kRadiansPerDegree; break;
    case proto::HEADING_INWARDS: angle_rad = kt_atan2(to_y_mm, to_x_mm); break;
    case proto::HEADING_OUTWARDS: angle_rad = kt_atan2(-to_y_mm, -to_x_mm); break;
  }
  placed_.heading_rad[robot] = wrapped(angle_rad);
}

void Placement::place_grid(const Group& group) {
  const proto::Layout& layout = group.spec->layout();
  const proto::GridLayout& grid = layout.grid();
  std::uint32_t columns = std::min(grid.columns(), group.count);
  if (columns == 0) {
    while (std::uint64_t{columns} * columns < group.count) ++columns;
  }
  const std::uint32_t rows = (group.count + columns - 1) / columns;
  for (std::uint32_t i = 0; i < group.count; ++i) {
    const std::uint32_t row = i / columns;
    const std::uint32_t in_row = grid.from_first_row() ? std::min(columns, group.count - row * columns) : columns;
    const double right = i % columns - (in_row - 1) / 2.0,
                 up = (grid.from_first_row() ? 0 : (rows - 1) / 2.0) - row;
    set_position(group.first + i, layout.x_mm() + right * grid.pitch_mm(), layout.y_mm() + up * grid.pitch_mm());
    set_heading(group.first + i, layout, grid.heading(), grid.heading_deg());
  }
}

void Placement::place_rings(const Group& group) {
  const proto::Layout& layout = group.spec->layout();
  const proto::RingsLayout& rings = layout.rings();
  std::uint32_t robot = group.first;
  for (int ring = 0; ring < rings.count_size(); ++ring) {
    for (std::uint32_t j = 0; j < rings.count(ring); ++j, ++robot) {
      double sine, cosine;
      kt_sincos(2 * kPi * j / rings.count(ring), &sine, &cosine);
      set_position(robot, layout.x_mm() + rings.radius_mm(ring) * cosine,
                   layout.y_mm() + rings.radius_mm(ring) * sine);
      set_heading(robot, layout, rings.heading(), rings.heading_deg());
    }
  }
}

void Placement::place_poses(const Group& group) {
  const proto::Layout& layout = group.spec->layout();
  for (std::uint32_t i = 0; i < group.count; ++i) {
    set_position(group.first + i, layout.x_mm() + group.csv.x_mm[i], layout.y_mm() + group.csv.y_mm[i]);
    placed_.heading_rad[group.first + i] = group.csv.heading_rad[i];
  }
}

void Placement::place_random(const Group& group) {
  const proto::Layout& layout = group.spec->layout();
  const proto::RandomLayout& spec = layout.random();
  struct Span {
    double min_mm, max_mm;
  };
  // The interval of centres along one axis for which discs lie within the rectangle and within the walls.
  const auto span = [](double middle_mm, double extent_mm, double arena_mm) {
    return Span{std::max(middle_mm - extent_mm / 2, -arena_mm / 2) + kRobotRadius_mm,
                std::min(middle_mm + extent_mm / 2, arena_mm / 2) - kRobotRadius_mm};
  };
  const double width_mm = 2 * world_.arena.half_width_mm(), height_mm = 2 * world_.arena.half_height_mm();
  const Span x = span(layout.x_mm(), spec.has_width_mm() ? spec.width_mm() : width_mm, width_mm);
  const Span y = span(layout.y_mm(), spec.has_height_mm() ? spec.height_mm() : height_mm, height_mm);
  if (x.min_mm > x.max_mm || y.min_mm > y.max_mm) {
    throw error_at(group, group.first, "the rectangle has no room for a robot within the arena; move or widen it");
  }

  const double distance_mm = kDiameter_mm + spec.min_gap_mm();
  const bool walls_are_straight = world_.arena.kind() == ArenaShape::Kind::kRectangle;
  const auto blocked = [&](double x_mm, double y_mm) {
    return (!walls_are_straight && world_.arena.clearance_mm({x_mm, y_mm}) < kRobotRadius_mm) ||
           !body_within(x_mm, y_mm, kRobotRadius_mm + spec.min_gap_mm()).empty();
  };
  Occupancy occupancy{distance_mm, placed_.x_mm, placed_.y_mm};
  for (const Group& other : groups_) {
    if (other.spec->layout().has_random() && other.first >= group.first) continue;
    if (other.spec->has_cells()) continue;
    for (std::uint32_t i = 0; i < other.count; ++i) occupancy.add(other.first + i);
  }
  for (std::uint32_t i = 0; i < group.count; ++i) {
    const std::uint32_t robot = group.first + i;
    std::uint32_t trial = 0;
    do {
      if (trial == kMostTrials) {
        throw error_at(group, robot,
                       fmt::format("only {} of {} robots fit at random with gaps of {} mm; place fewer, widen the "
                                   "rectangle or lower min_gap_mm (about half of the area can be covered)",
                                   i, group.count, number_text(spec.min_gap_mm())));
      }
      const double u = random_.uniform(Stream::kLayout, robot, Tick{0}, 2 * trial);
      const double v = random_.uniform(Stream::kLayout, robot, Tick{0}, 2 * trial + 1);
      set_position(robot, x.min_mm + u * (x.max_mm - x.min_mm), y.min_mm + v * (y.max_mm - y.min_mm));
      ++trial;
    } while (occupancy.first_within(placed_.x_mm[robot], placed_.y_mm[robot], distance_mm) ||
             blocked(placed_.x_mm[robot], placed_.y_mm[robot]));
    occupancy.add(robot);
    set_heading(robot, layout, spec.heading(), spec.heading_deg());
  }
}

std::string Placement::body_within(double x_mm, double y_mm, double radius_mm) const {
  const auto reaches = [&](const Convex& shape, const Place& place) {
    const double dx_mm = place.x_mm - x_mm, dy_mm = place.y_mm - y_mm, far_mm = shape.reach_mm() + radius_mm;
    return dx_mm * dx_mm + dy_mm * dy_mm < far_mm * far_mm &&
           shape.nearest(place, {x_mm, y_mm}).distance_mm < radius_mm - kTouchTolerance_mm;
  };
  for (std::size_t i = 0; i < world_.obstacles.size(); ++i) {
    if (reaches(world_.obstacles[i].shape, world_.obstacles[i].place)) return fmt::format("obstacle[{}]", i);
  }
  for (std::size_t i = 0; i < world_.movables.size(); ++i) {
    if (reaches(world_.movables[i].shape, movable_places_[i])) return fmt::format("movable[{}]", i);
  }
  return {};
}

void Placement::check_movables() const {
  for (std::size_t i = 0; i < world_.movables.size(); ++i) {
    const std::string path = fmt::format("movable[{}]", i);
    const Convex& shape = world_.movables[i].shape;
    if (world_.arena.clearance_mm(shape, movable_places_[i]) < -kTouchTolerance_mm) {
      throw loaded_.locations.error(path, fmt::format("{} reaches out of the arena; move it inwards", path));
    }
    const auto refuse_overlap = [&](const std::string& other, const Convex& its, const Place& place) {
      const double far_mm = shape.reach_mm() + its.reach_mm();
      const double dx_mm = place.x_mm - movable_places_[i].x_mm, dy_mm = place.y_mm - movable_places_[i].y_mm;
      if (dx_mm * dx_mm + dy_mm * dy_mm > far_mm * far_mm) return;
      if (separation_mm(shape, movable_places_[i], its, place) >= -kTouchTolerance_mm) return;
      throw loaded_.locations.error(path, fmt::format("{} overlaps {}; move them apart", path, other));
    };
    for (std::size_t k = 0; k < world_.obstacles.size(); ++k)
      refuse_overlap(fmt::format("obstacle[{}]", k), world_.obstacles[k].shape, world_.obstacles[k].place);
    for (std::size_t k = 0; k < i; ++k)
      refuse_overlap(fmt::format("movable[{}]", k), world_.movables[k].shape, movable_places_[k]);
  }
}

void Placement::check_placed(Occupancy& occupancy, const Group& group) const {
  const bool walls_are_straight = world_.arena.kind() == ArenaShape::Kind::kRectangle;
  const double x_max_mm = world_.arena.half_width_mm() - kRobotRadius_mm;
  const double y_max_mm = world_.arena.half_height_mm() - kRobotRadius_mm;
  for (std::uint32_t robot = group.first; robot < group.first + group.count; ++robot) {
    const double x_mm = placed_.x_mm[robot], y_mm = placed_.y_mm[robot];
    if (beyond(x_mm, x_max_mm) || beyond(y_mm, y_max_mm)) {
      throw error_at(group, robot,
                     fmt::format("{} reaches out of the arena; centres take x within +-{} mm and y within +-{} mm",
                                 described(robot), number_text(x_max_mm), number_text(y_max_mm)));
    }
    if (!walls_are_straight && world_.arena.clearance_mm({x_mm, y_mm}) < kRobotRadius_mm - kTouchTolerance_mm) {
      throw error_at(group, robot,
                     fmt::format("{} reaches out of the arena, a {}; keep centres {} mm from its wall",
                                 described(robot), world_.arena.described(), number_text(kRobotRadius_mm)));
    }
    if (const std::string body = body_within(x_mm, y_mm, kRobotRadius_mm); !body.empty()) {
      throw error_at(group, robot,
                     fmt::format("{} overlaps {}; keep its centre {} mm from it", described(robot), body,
                                 number_text(kRobotRadius_mm)));
    }
    if (const auto other = occupancy.first_within(x_mm, y_mm, kDiameter_mm - kTouchTolerance_mm)) {
      throw error_at(group, robot,
                     fmt::format("{} overlaps {}; keep centres at least {} mm apart", described(robot),
                                 described(*other), number_text(kDiameter_mm)));
    }
    occupancy.add(robot);
  }
}

void Placement::check_cells_within(const Group& group) const {
  for (std::uint32_t cell = group.first; cell < group.first + group.count; ++cell) {
    const double x_mm = placed_.x_mm[cell], y_mm = placed_.y_mm[cell];
    if (beyond(x_mm, world_.arena.half_width_mm()) || beyond(y_mm, world_.arena.half_height_mm()))
      throw error_at(
          group, cell,
          fmt::format("{}, a cell, lies outside of the arena; use fewer columns or rows, or a larger arena",
                      described(cell)));
  }
}

PlacedRobots Placement::place() {
  check_movables();
  measure();
  Occupancy occupancy{kDiameter_mm, placed_.x_mm, placed_.y_mm};
  for (const Group& group : groups_) {
    switch (group.spec->layout().shape_case()) {
      case proto::Layout::kRandom: continue;
      case proto::Layout::kRings: place_rings(group); break;
      case proto::Layout::kPoses: place_poses(group); break;
      case proto::Layout::kGrid:
      case proto::Layout::SHAPE_NOT_SET: place_grid(group); break;
    }
    if (group.spec->has_cells())
      check_cells_within(group);
    else
      check_placed(occupancy, group);
  }
  for (const Group& group : groups_) {
    if (group.spec->layout().has_random()) place_random(group);
  }
  return std::move(placed_);
}

}  // namespace

PlacedRobots place_robots(const LoadedExperiment& loaded) {
  check_fields(loaded);
  return Placement{loaded}.place();
}

proto::Experiment with_counts(const LoadedExperiment& loaded, const PlacedRobots& placed) {
  proto::Experiment experiment = loaded.experiment;
  for (int g = 0; g < experiment.robots_size(); ++g) {
    experiment.mutable_robots(g)->set_count(placed.group_count[static_cast<std::size_t>(g)]);
  }
  return experiment;
}

}  // namespace kilotwin

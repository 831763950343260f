/// What stands in the arena besides robots, as the experiment states it: walls, obstacles, movable bodies.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/pose.hpp"
#include "core/geometry/convex.hpp"

namespace kilotwin {

namespace proto {
class Arena;
class Experiment;
class MovableBody;
class Obstacle;
}  // namespace proto

/// Standard gravity, m/s^2.
inline constexpr double kGravity_m_s2 = 9.80665;

class ArenaShape {
 public:
  enum class Kind : std::uint8_t { kRectangle, kCircle, kPolygon };

  /// Throws std::invalid_argument where its polygon is none.
  explicit ArenaShape(const proto::Arena&);

  [[nodiscard]] Kind kind() const { return kind_; }
  /// The smallest rectangle around the origin that holds it has these halves.
  [[nodiscard]] double half_width_mm() const { return half_width_mm_; }
  [[nodiscard]] double half_height_mm() const { return half_height_mm_; }
  [[nodiscard]] double radius_mm() const { return radius_mm_; }  ///< of a circle
  /// Arena.width_mm and height_mm: of a rectangle its extents; of another shape their defaults.
  [[nodiscard]] double stated_width_mm() const { return stated_width_mm_; }
  [[nodiscard]] double stated_height_mm() const { return stated_height_mm_; }
  /// Of a polygon, anticlockwise, in the arena's frame; edge i goes from corner i to the next, with its outward normal.
  [[nodiscard]] const std::vector<Point2>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Point2>& normals() const { return normals_; }
  /// Distance of a point within from the nearest wall, mm; negative outside.
  [[nodiscard]] double clearance_mm(Point2) const;
  /// The least clearance of any point of a body.
  [[nodiscard]] double clearance_mm(const Convex&, const Place&) const;
  /// "width x height" or what it is, for people.
  [[nodiscard]] std::string described() const;

 private:
  Kind kind_;
  double stated_width_mm_, stated_height_mm_;
  double half_width_mm_, half_height_mm_, radius_mm_ = 0;
  std::vector<Point2> corners_, normals_;
};

struct ObstacleBody {
  Convex shape;
  Place place;
  double heading_rad;  ///< in [-pi, pi)
  double height_mm;
};

struct MovableBodyModel {
  Convex shape;
  Pose pose;  ///< of its centre at tick 0
  double height_mm;
  double mass_kg;
  double friction;  ///< coefficient of dry friction on the floor

  /// The force that friction holds at most, N.
  [[nodiscard]] double grip_N() const { return friction * mass_kg * kGravity_m_s2; }
};

struct World {
  /// Throws std::invalid_argument where a shape is none.
  explicit World(const proto::Experiment&);

  ArenaShape arena;
  std::vector<ObstacleBody> obstacles;
  std::vector<MovableBodyModel> movables;
};

/// The obstacle's or movable body's shape about its centre, and where in the shape's own coordinates that centre lies. Throws
/// std::invalid_argument where it is none.
[[nodiscard]] Convex shape_of(const proto::Obstacle&, Point2& centre);
[[nodiscard]] Convex shape_of(const proto::MovableBody&, Point2& centre);

}  // namespace kilotwin

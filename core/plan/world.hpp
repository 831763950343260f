/// The arena without robots: walls, obstacles, movable bodies.
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

  /// Throws std::invalid_argument if its polygon is not convex or does not contain the origin.
  explicit ArenaShape(const proto::Arena&);

  [[nodiscard]] Kind kind() const { return kind_; }
  /// Half extents of the smallest rectangle around the origin that contains the arena.
  [[nodiscard]] double half_width_mm() const { return half_width_mm_; }
  [[nodiscard]] double half_height_mm() const { return half_height_mm_; }
  [[nodiscard]] double radius_mm() const { return radius_mm_; }  ///< for kCircle
  /// Arena.width_mm and height_mm: the extents of a rectangle; for other shapes the fields' defaults.
  [[nodiscard]] double stated_width_mm() const { return stated_width_mm_; }
  [[nodiscard]] double stated_height_mm() const { return stated_height_mm_; }
  /// For kPolygon: corners in the arena's frame, anticlockwise. Edge i goes from corner i to the next; normals()[i] is its
  /// outward normal.
  [[nodiscard]] const std::vector<Point2>& corners() const { return corners_; }
  [[nodiscard]] const std::vector<Point2>& normals() const { return normals_; }
  /// Distance of a point from the nearest wall, mm; negative outside.
  [[nodiscard]] double clearance_mm(Point2) const;
  /// The smallest clearance of any point of a body, mm.
  [[nodiscard]] double clearance_mm(const Convex&, const Place&) const;
  /// Size or shape for messages: "400 mm x 300 mm", "circle of radius 200 mm".
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
  Pose pose;  ///< pose of its centre at tick 0
  double height_mm;
  double mass_kg;
  double friction;  ///< coefficient of dry friction on the floor

  /// Limit of the friction force on the floor, N.
  [[nodiscard]] double grip_N() const { return friction * mass_kg * kGravity_m_s2; }
};

struct World {
  /// Throws std::invalid_argument if a shape is invalid.
  explicit World(const proto::Experiment&);

  ArenaShape arena;
  std::vector<ObstacleBody> obstacles;
  std::vector<MovableBodyModel> movables;
};

/// The shape of an obstacle or movable body, relative to its centre. `centre` becomes the centre in the coordinates of the stated
/// polygon. Throws std::invalid_argument if the shape is invalid.
[[nodiscard]] Convex shape_of(const proto::Obstacle&, Point2& centre);
[[nodiscard]] Convex shape_of(const proto::MovableBody&, Point2& centre);

}  // namespace kilotwin

/// Convex shapes in the plane: discs and polygons, about their centre (the centroid of their area). Lengths mm, angles rad.
#pragma once

#include <cstddef>
#include <vector>

namespace kilotwin {

struct Point2 {
  double x_mm = 0, y_mm = 0;
};

/// Position and orientation of a shape.
struct Place {
  double x_mm = 0, y_mm = 0;
  double cosine = 1, sine = 0;

  [[nodiscard]] static Place at(double x_mm, double y_mm, double heading_rad);
  /// From the shape's frame to the arena's.
  [[nodiscard]] Point2 to_arena(Point2 p) const {
    return {x_mm + (cosine * p.x_mm - sine * p.y_mm), y_mm + (sine * p.x_mm + cosine * p.y_mm)};
  }
  /// From the arena's frame to the shape's.
  [[nodiscard]] Point2 to_shape(Point2 p) const {
    const double dx = p.x_mm - x_mm, dy = p.y_mm - y_mm;
    return {cosine * dx + sine * dy, cosine * dy - sine * dx};
  }
};

/// The point of a shape's rim nearest to another point.
struct Nearest {
  double normal_x = 0, normal_y = 0;  ///< unit, out of the shape towards the other point
  double distance_mm = 0;             ///< negative inside
  Point2 at;                          ///< on the rim
};

class Convex {
 public:
  [[nodiscard]] static Convex disc(double radius_mm);
  /// Corners in order, in either direction. Corners may be collinear with their neighbours. Throws std::invalid_argument if
  /// the polygon is not convex. If `centre` is given, it is set to the centroid, which becomes the origin.
  [[nodiscard]] static Convex polygon(std::vector<Point2> corners, Point2* centre = nullptr);
  [[nodiscard]] static Convex box(double width_mm, double length_mm);

  [[nodiscard]] bool is_disc() const { return corners_.empty(); }
  [[nodiscard]] double radius_mm() const { return radius_mm_; }  ///< of a disc; 0: a polygon
  /// Anticlockwise, in the shape's frame; edge i goes from corner i to the next. Empty: a disc.
  [[nodiscard]] const std::vector<Point2>& corners() const { return corners_; }
  /// Outward normals of the edges, unit.
  [[nodiscard]] const std::vector<Point2>& normals() const { return normals_; }
  /// Largest distance of any point from the centre.
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  [[nodiscard]] double area_mm2() const { return area_mm2_; }
  /// Mean distance of the area from its centre: the lever of dry friction's moment, for an evenly distributed weight and a
  /// rotation about the centre.
  [[nodiscard]] double mean_distance_mm() const { return mean_distance_mm_; }

  /// For a point in the shape's own frame.
  [[nodiscard]] Nearest nearest(Point2) const;
  /// For a point in the arena's frame.
  [[nodiscard]] Nearest nearest(const Place&, Point2) const;

 private:
  double radius_mm_ = 0, reach_mm_ = 0, area_mm2_ = 0, mean_distance_mm_ = 0;
  std::vector<Point2> corners_, normals_;
};

/// Separation of two shapes along the best of their edges' normals, or along the line of centres. It equals the distance if an
/// edge faces the other shape, and is smaller if corner faces corner. Negative: depth of the overlap.
[[nodiscard]] double separation_mm(const Convex& a, const Place& at_a, const Convex& b, const Place& at_b);

}  // namespace kilotwin

#include "core/plan/world.hpp"

#include <algorithm>
#include <stdexcept>

#include "core/math/elementary.h"
#include "idl/experiment.pb.h"

namespace kilotwin {
namespace {

constexpr double kRadiansPerDegree = kPi / 180;
constexpr int kMostCorners = 32;

std::vector<Point2> corners_of(const proto::Polygon& polygon) {
  if (polygon.x_mm_size() != polygon.y_mm_size())
    throw std::invalid_argument("it has " + std::to_string(polygon.x_mm_size()) + " x_mm and " +
                                std::to_string(polygon.y_mm_size()) + " y_mm");
  if (polygon.x_mm_size() > kMostCorners) throw std::invalid_argument("it has more than 32 corners");
  std::vector<Point2> corners;
  for (int i = 0; i < polygon.x_mm_size(); ++i) corners.push_back({polygon.x_mm(i), polygon.y_mm(i)});
  return corners;
}

template <class Body> Convex any_shape_of(const Body& body, Point2& centre) {
  centre = {};
  switch (body.shape_case()) {
    case Body::kBox:
      if (!body.box().has_width_mm() || !body.box().has_length_mm())
        throw std::invalid_argument("width_mm or length_mm is missing");
      return Convex::box(body.box().width_mm(), body.box().length_mm());
    case Body::kCylinder:
      if (!body.cylinder().has_radius_mm()) throw std::invalid_argument("radius_mm is missing");
      return Convex::disc(body.cylinder().radius_mm());
    case Body::kPolygon: return Convex::polygon(corners_of(body.polygon()), &centre);
    default: throw std::invalid_argument("it has no shape");
  }
}

template <class Body> double height_of(const Body& body) {
  return body.has_box()        ? body.box().height_mm()
         : body.has_cylinder() ? body.cylinder().height_mm()
                               : body.polygon().height_mm();
}

/// The pose of the shape's centre.
template <class Body> Pose pose_of(const Body& body, Point2 centre) {
  const double heading_rad = wrapped(body.heading_deg() * kRadiansPerDegree);
  const Point2 at = Place::at(body.x_mm(), body.y_mm(), heading_rad).to_arena(centre);
  return {at.x_mm, at.y_mm, heading_rad};
}

}  // namespace

Convex shape_of(const proto::Obstacle& body, Point2& centre) { return any_shape_of(body, centre); }
Convex shape_of(const proto::MovableBody& body, Point2& centre) { return any_shape_of(body, centre); }

ArenaShape::ArenaShape(const proto::Arena& arena)
    : kind_(Kind::kRectangle),
      stated_width_mm_(arena.width_mm()),
      stated_height_mm_(arena.height_mm()),
      half_width_mm_(arena.width_mm() / 2),
      half_height_mm_(arena.height_mm() / 2) {
  if (arena.has_circle()) {
    if (!arena.circle().has_radius_mm()) throw std::invalid_argument("radius_mm is missing");
    kind_ = Kind::kCircle;
    radius_mm_ = half_width_mm_ = half_height_mm_ = arena.circle().radius_mm();
  }
  if (arena.has_polygon()) {
    kind_ = Kind::kPolygon;
    Point2 centre;
    const Convex shape = Convex::polygon(corners_of(arena.polygon()), &centre);
    half_width_mm_ = half_height_mm_ = 0;
    for (const Point2 corner : shape.corners()) {
      corners_.push_back({corner.x_mm + centre.x_mm, corner.y_mm + centre.y_mm});
      half_width_mm_ = std::max({half_width_mm_, corners_.back().x_mm, -corners_.back().x_mm});
      half_height_mm_ = std::max({half_height_mm_, corners_.back().y_mm, -corners_.back().y_mm});
    }
    normals_ = shape.normals();
    if (!(clearance_mm(Point2{}) > 0)) throw std::invalid_argument("the origin lies outside of it");
  }
}

double ArenaShape::clearance_mm(Point2 p) const {
  switch (kind_) {
    case Kind::kCircle: return radius_mm_ - __builtin_sqrt(p.x_mm * p.x_mm + p.y_mm * p.y_mm);
    case Kind::kPolygon: {
      double least = 1e300;
      for (std::size_t i = 0; i < corners_.size(); ++i) {
        least = std::min(
            least, normals_[i].x_mm * (corners_[i].x_mm - p.x_mm) + normals_[i].y_mm * (corners_[i].y_mm - p.y_mm));
      }
      return least;
    }
    case Kind::kRectangle: break;
  }
  return std::min(
      {half_width_mm_ - p.x_mm, half_width_mm_ + p.x_mm, half_height_mm_ - p.y_mm, half_height_mm_ + p.y_mm});
}

double ArenaShape::clearance_mm(const Convex& shape, const Place& place) const {
  if (shape.is_disc()) return clearance_mm({place.x_mm, place.y_mm}) - shape.radius_mm();
  double least = 1e300;
  for (const Point2 corner : shape.corners()) least = std::min(least, clearance_mm(place.to_arena(corner)));
  return least;
}

std::string ArenaShape::described() const {
  const auto number = [](double mm) {
    std::string text = std::to_string(mm);
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
    return text;
  };
  switch (kind_) {
    case Kind::kCircle: return "circle of radius " + number(radius_mm_) + " mm";
    case Kind::kPolygon: return "polygon of " + std::to_string(corners_.size()) + " corners";
    case Kind::kRectangle: break;
  }
  return number(2 * half_width_mm_) + " mm x " + number(2 * half_height_mm_) + " mm";
}

World::World(const proto::Experiment& experiment) : arena(experiment.arena()) {
  for (const proto::Obstacle& body : experiment.obstacle()) {
    Point2 centre;
    Convex shape = shape_of(body, centre);
    const Pose pose = pose_of(body, centre);
    obstacles.push_back(
        {std::move(shape), Place::at(pose.x_mm, pose.y_mm, pose.heading_rad), pose.heading_rad, height_of(body)});
  }
  for (const proto::MovableBody& body : experiment.movable()) {
    Point2 centre;
    Convex shape = shape_of(body, centre);
    movables.push_back(
        {std::move(shape), pose_of(body, centre), height_of(body), body.mass_g() / 1000, body.friction()});
  }
}

}  // namespace kilotwin

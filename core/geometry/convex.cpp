#include "core/geometry/convex.hpp"

#include <algorithm>
#include <stdexcept>

#include "core/math/elementary.h"

namespace kilotwin {
namespace {

double length(double x, double y) { return __builtin_sqrt(x * x + y * y); }
double cross(Point2 a, Point2 b) { return a.x_mm * b.y_mm - a.y_mm * b.x_mm; }

/// Integral of the distance from the origin over the triangle of the origin and an edge. With the distance d of the edge's
/// line, t along it, and R = sqrt(d^2 + t^2), it is (d t R + d^3 ln((R + t) / d)) / 6 between the ends.
double distance_integral(Point2 from, Point2 to) {
  const double ux = to.x_mm - from.x_mm, uy = to.y_mm - from.y_mm, side = length(ux, uy);
  const double d = cross(from, to) / side;
  const auto primitive = [&](Point2 p) {
    const double t = (p.x_mm * ux + p.y_mm * uy) / side, r = length(p.x_mm, p.y_mm);
    // (R + t) (R - t) = d^2 gives the sum without cancellation.
    const double sum = t >= 0 ? r + t : d * d / (r - t);
    return (d * t * r + d * d * d * kt_log(sum / d)) / 6;
  };
  return primitive(to) - primitive(from);
}

/// Least distance of b's points from the line of an edge of a, outwards; the maximum over all edges of a.
double separation_by_edges(const Convex& a, const Place& at_a, const Convex& b, const Place& at_b) {
  double best = -1e300;
  for (std::size_t i = 0; i < a.corners().size(); ++i) {
    double least = 1e300;
    const auto add = [&](Point2 p, double radius_mm) {
      const Point2 local = at_a.to_shape(p);
      least = std::min(least, a.normals()[i].x_mm * (local.x_mm - a.corners()[i].x_mm) +
                                  a.normals()[i].y_mm * (local.y_mm - a.corners()[i].y_mm) - radius_mm);
    };
    if (b.is_disc()) add({at_b.x_mm, at_b.y_mm}, b.radius_mm());
    for (const Point2 corner : b.corners()) add(at_b.to_arena(corner), 0);
    best = std::max(best, least);
  }
  return best;
}

}  // namespace

Place Place::at(double x_mm, double y_mm, double heading_rad) {
  Place place{x_mm, y_mm, 1, 0};
  kt_sincos(heading_rad, &place.sine, &place.cosine);
  return place;
}

Convex Convex::disc(double radius_mm) {
  if (!(radius_mm > 0)) throw std::invalid_argument("a disc's radius is above 0");
  constexpr double pi = 3.14159265358979323846;
  Convex shape;
  shape.radius_mm_ = shape.reach_mm_ = radius_mm;
  shape.area_mm2_ = pi * radius_mm * radius_mm;
  shape.mean_distance_mm_ = 2 * radius_mm / 3;
  return shape;
}

Convex Convex::polygon(std::vector<Point2> corners, Point2* centre) {
  const std::size_t count = corners.size();
  if (count < 3) throw std::invalid_argument("it has fewer than 3 corners");
  const auto at = [&](std::size_t i) { return corners[i % count]; };
  const auto minus = [](Point2 a, Point2 b) { return Point2{a.x_mm - b.x_mm, a.y_mm - b.y_mm}; };
  double twice_area = 0, extent = 0;
  for (std::size_t i = 0; i < count; ++i) {
    twice_area += cross(minus(at(i), at(0)), minus(at(i + 1), at(0)));
    extent = std::max(extent, length(minus(at(i), at(0)).x_mm, minus(at(i), at(0)).y_mm));
  }
  if (twice_area < 0) {
    std::reverse(corners.begin(), corners.end());
    twice_area = -twice_area;
  }
  if (!(twice_area > 1e-6 * extent * extent)) throw std::invalid_argument("its corners lie on a line");
  double turned = 0;  // A star turns by more than 2 pi.
  for (std::size_t i = 0; i < count; ++i) {
    const Point2 in = minus(at(i + 1), at(i)), out = minus(at(i + 2), at(i + 1));
    const double in_mm = length(in.x_mm, in.y_mm), out_mm = length(out.x_mm, out.y_mm);
    if (!(in_mm > 1e-6 * extent)) throw std::invalid_argument("two corners lie in the same place");
    const double sine = cross(in, out) / (in_mm * out_mm);
    const double cosine = (in.x_mm * out.x_mm + in.y_mm * out.y_mm) / (in_mm * out_mm);
    if (sine < -1e-9 || (cosine < 0 && sine < 1e-9)) throw std::invalid_argument("it is not convex");
    turned += kt_atan2(sine, cosine);
  }
  if (turned > 6.5) throw std::invalid_argument("its edges cross");

  double x = 0, y = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Point2 a = minus(at(i), at(0)), b = minus(at(i + 1), at(0));
    x += (a.x_mm + b.x_mm) * cross(a, b) / (3 * twice_area);
    y += (a.y_mm + b.y_mm) * cross(a, b) / (3 * twice_area);
  }
  const Point2 centroid{corners[0].x_mm + x, corners[0].y_mm + y};
  if (centre != nullptr) *centre = centroid;
  Convex shape;
  shape.area_mm2_ = twice_area / 2;
  for (Point2& p : corners) {
    p = minus(p, centroid);
    shape.reach_mm_ = std::max(shape.reach_mm_, length(p.x_mm, p.y_mm));
  }
  double integral = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Point2 edge = minus(at(i + 1), at(i));
    const double side = length(edge.x_mm, edge.y_mm);
    shape.normals_.push_back({edge.y_mm / side, -edge.x_mm / side});
    integral += distance_integral(at(i), at(i + 1));
  }
  shape.mean_distance_mm_ = integral / shape.area_mm2_;
  shape.corners_ = std::move(corners);
  return shape;
}

Convex Convex::box(double width_mm, double length_mm) {
  const double x = width_mm / 2, y = length_mm / 2;
  return polygon({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
}

Nearest Convex::nearest(Point2 p) const {
  if (is_disc()) {
    const double distance = length(p.x_mm, p.y_mm);
    const double nx = distance > 0 ? p.x_mm / distance : 1, ny = distance > 0 ? p.y_mm / distance : 0;
    return {nx, ny, distance - radius_mm_, {nx * radius_mm_, ny * radius_mm_}};
  }
  // The nearest edge, or one that ends in the nearest corner, is the edge whose line the point exceeds most.
  std::size_t edge = 0;
  double beyond = -1e300;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const double out =
        normals_[i].x_mm * (p.x_mm - corners_[i].x_mm) + normals_[i].y_mm * (p.y_mm - corners_[i].y_mm);
    if (out > beyond) {
      beyond = out;
      edge = i;
    }
  }
  const Point2 from = corners_[edge], to = corners_[edge + 1 == corners_.size() ? 0 : edge + 1], n = normals_[edge];
  const double along = (p.y_mm - from.y_mm) * n.x_mm - (p.x_mm - from.x_mm) * n.y_mm;
  const double past = (to.x_mm - p.x_mm) * -n.y_mm + (to.y_mm - p.y_mm) * n.x_mm;
  if (beyond <= 0 || (along >= 0 && past >= 0)) {
    return {n.x_mm, n.y_mm, beyond, {p.x_mm - beyond * n.x_mm, p.y_mm - beyond * n.y_mm}};
  }
  const Point2 corner = along < 0 ? from : to;
  const double dx = p.x_mm - corner.x_mm, dy = p.y_mm - corner.y_mm, distance = length(dx, dy);
  return {dx / distance, dy / distance, distance, corner};
}

Nearest Convex::nearest(const Place& place, Point2 p) const {
  Nearest found = nearest(place.to_shape(p));
  const double nx = found.normal_x, ny = found.normal_y;
  found.normal_x = place.cosine * nx - place.sine * ny;
  found.normal_y = place.sine * nx + place.cosine * ny;
  found.at = place.to_arena(found.at);
  return found;
}

double separation_mm(const Convex& a, const Place& at_a, const Convex& b, const Place& at_b) {
  double best = std::max(separation_by_edges(a, at_a, b, at_b), separation_by_edges(b, at_b, a, at_a));
  if (a.is_disc()) best = std::max(best, b.nearest(at_b, {at_a.x_mm, at_a.y_mm}).distance_mm - a.radius_mm());
  if (b.is_disc()) best = std::max(best, a.nearest(at_a, {at_b.x_mm, at_b.y_mm}).distance_mm - b.radius_mm());
  return best;
}

}  // namespace kilotwin

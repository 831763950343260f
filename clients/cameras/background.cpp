#include "clients/cameras/background.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin::cameras {
namespace {

/// Share of a pixel within an edge that runs `inside_mm` from the pixel's centre.
double coverage(double inside_mm, double px_per_mm) { return std::clamp(0.5 + inside_mm * px_per_mm, 0.0, 1.0); }

Colour mixed(const Colour& under, const Colour& over, double share) {
  Colour result;
  for (std::size_t c = 0; c < result.size(); ++c) result[c] = under[c] + share * (over[c] - under[c]);
  return result;
}

/// Values in [-1, 1) on a lattice that repeats after kPeriod points, which is seen by nobody.
class Lattice {
 public:
  static constexpr int kPeriod = 512;

  Lattice() : values_(static_cast<std::size_t>(kPeriod) * kPeriod) {
    constexpr std::uint64_t kFloorSeed = 4711;
    cv::Mat table(kPeriod, kPeriod, CV_32F, values_.data());
    cv::RNG(kFloorSeed).fill(table, cv::RNG::UNIFORM, -1, 1);
  }
  /// Smooth noise between lattice points `cell_mm` apart.
  [[nodiscard]] double at(double x_mm, double y_mm, double cell_mm) const {
    const double u = x_mm / cell_mm, v = y_mm / cell_mm;
    const double column = std::floor(u), row = std::floor(v);
    const auto eased = [](double t) { return t * t * (3 - 2 * t); };
    const double fu = eased(u - column), fv = eased(v - row);
    const int c = static_cast<int>(column), r = static_cast<int>(row);
    const double top = point(c, r) + fu * (point(c + 1, r) - point(c, r));
    const double bottom = point(c, r + 1) + fu * (point(c + 1, r + 1) - point(c, r + 1));
    return top + fv * (bottom - top);
  }

 private:
  [[nodiscard]] double point(int column, int row) const {
    constexpr unsigned kMask = kPeriod - 1;
    const unsigned c = static_cast<unsigned>(column) & kMask, r = static_cast<unsigned>(row) & kMask;
    return static_cast<double>(values_[r * kPeriod + c]);
  }
  std::vector<float> values_;
};

/// Stains, blotches and grain.
double texture_at(const Lattice& lattice, const Look& look, double x_mm, double y_mm) {
  if (look.floor_texture == 0) return 0;
  return look.floor_texture *
         (0.5 * lattice.at(x_mm, y_mm, 90) + 0.3 * lattice.at(x_mm, y_mm, 14) + 0.2 * lattice.at(x_mm, y_mm, 2.5));
}

/// The colour of the floor plane at a point, without light.
Colour surface_at(const World& world, const Lattice& lattice, const Look& look, double x_mm, double y_mm,
                  double px_per_mm) {
  const double texture = texture_at(lattice, look, x_mm, y_mm);
  Colour colour = look.floor;
  for (double& level : colour) level += texture;
  const double clearance_mm = world.arena.clearance_mm({x_mm, y_mm});
  if (clearance_mm < 1 / px_per_mm) {
    const double beyond = coverage(-clearance_mm - look.wall_width_mm, px_per_mm);
    colour = mixed(mixed(look.wall, look.outside, beyond), colour, coverage(clearance_mm, px_per_mm));
  }
  for (const ObstacleBody& obstacle : world.obstacles) {
    const double dx = x_mm - obstacle.place.x_mm, dy = y_mm - obstacle.place.y_mm;
    const double reach = obstacle.shape.reach_mm() + 1 / px_per_mm;
    if (dx * dx + dy * dy > reach * reach) continue;
    const double inside_mm = -obstacle.shape.nearest(obstacle.place, {x_mm, y_mm}).distance_mm;
    // A lighter rim makes the body stand out from the floor.
    const Colour face = mixed(look.obstacle, look.floor, 0.25 * coverage(2 - inside_mm, px_per_mm));
    colour = mixed(colour, face, coverage(inside_mm, px_per_mm));
  }
  return colour;
}

double scale_at(const CameraModel& camera, double x_mm, double y_mm) {
  return std::sqrt(std::abs(cv::determinant(camera.jacobian({x_mm, y_mm, 0}))));
}

cv::Vec3b lit(const Colour& colour, double light) {
  return {cv::saturate_cast<std::uint8_t>(colour[0] * light), cv::saturate_cast<std::uint8_t>(colour[1] * light),
          cv::saturate_cast<std::uint8_t>(colour[2] * light)};
}

}  // namespace

cv::Mat paint_background(const World& world, const CameraModel& camera, const Look& look) {
  cv::Mat picture(camera.height_px, camera.width_px, CV_8UC3);
  const cv::Point2d middle = camera.at_height({camera.width_px / 2.0, camera.height_px / 2.0}, 0);
  const double px_per_mm = scale_at(camera, middle.x, middle.y);
  const CameraModel::ToPlane floor(camera, 0);
  const Lattice lattice;
  for (int row = 0; row < picture.rows; ++row) {
    auto* const pixels = picture.ptr<cv::Vec3b>(row);
    for (int column = 0; column < picture.cols; ++column) {
      const cv::Point2d pixel(column, row);
      const cv::Point2d at = floor(pixel);
      const double light = camera.gain * camera.lens_share(pixel) * camera.room_light(at.x, at.y);
      pixels[column] = lit(surface_at(world, lattice, look, at.x, at.y, px_per_mm), light);
    }
  }
  return picture;
}

void paint_movable(cv::Mat& picture, const Convex& shape, const Pose& pose, const CameraModel& camera,
                   const Look& look) {
  const Place place = Place::at(pose.x_mm, pose.y_mm, pose.heading_rad);
  const double px_per_mm = scale_at(camera, pose.x_mm, pose.y_mm);
  const cv::Point2d centre = camera.project({pose.x_mm, pose.y_mm, 0});
  const int reach_px = static_cast<int>(std::ceil(1.1 * shape.reach_mm() * px_per_mm)) + 2;
  const cv::Rect box = cv::Rect(static_cast<int>(centre.x) - reach_px, static_cast<int>(centre.y) - reach_px,
                                2 * reach_px + 1, 2 * reach_px + 1) &
                       cv::Rect(0, 0, picture.cols, picture.rows);
  const CameraModel::ToPlane floor(camera, 0);
  for (int row = box.y; row < box.y + box.height; ++row) {
    auto* const pixels = picture.ptr<cv::Vec3b>(row);
    for (int column = box.x; column < box.x + box.width; ++column) {
      const cv::Point2d pixel(column, row);
      const cv::Point2d at = floor(pixel);
      const double inside_mm = -shape.nearest(place, {at.x, at.y}).distance_mm;
      const double share = coverage(inside_mm, px_per_mm);
      if (share == 0) continue;
      const double light = camera.gain * camera.lens_share(pixel) * camera.room_light(at.x, at.y);
      // A stripe from the centre forward shows how the body is turned.
      const Point2 own = place.to_shape({at.x, at.y});
      const bool stripe = own.x_mm > 0 && std::abs(own.y_mm) < 2;
      Colour face = mixed(look.movable, look.floor, 0.3 * coverage(3 - inside_mm, px_per_mm));
      if (stripe) face = mixed(face, look.outside, 0.5);
      const cv::Vec3b under = pixels[column];
      pixels[column] = lit(mixed({under[0] / 1.0, under[1] / 1.0, under[2] / 1.0},
                                 {face[0] * light, face[1] * light, face[2] * light}, share),
                           1);
    }
  }
}

}  // namespace kilotwin::cameras

#include "clients/cameras/camera_model.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/error.hpp"

namespace kilotwin::cameras {
namespace {

/// Distance from the arena's centre at which uneven_light holds.
constexpr double kLightReference_mm = 1000;

cv::Point2d distorted(const Distortion& d, const cv::Point2d& p) {
  const double r2 = p.x * p.x + p.y * p.y;
  const double radial = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  return {p.x * radial + 2 * d.p1 * p.x * p.y + d.p2 * (r2 + 2 * p.x * p.x),
          p.y * radial + d.p1 * (r2 + 2 * p.y * p.y) + 2 * d.p2 * p.x * p.y};
}

/// By fixed-point iteration, which converges for the distortion of ordinary lenses.
cv::Point2d undistorted(const Distortion& d, const cv::Point2d& p) {
  constexpr int kMost = 50;
  constexpr double kClose = 1e-10;
  cv::Point2d guess = p;
  for (int i = 0; i < kMost; ++i) {
    const cv::Point2d error = distorted(d, guess) - p;
    guess -= error;
    if (std::abs(error.x) + std::abs(error.y) < kClose) break;
  }
  return guess;
}

}  // namespace

CameraModel CameraModel::overhead(int width_px, int height_px, double px_per_mm, double centre_x_mm,
                                  double centre_y_mm, double height_mm) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  const double focal_px = px_per_mm * height_mm;
  camera.K = cv::Matx33d(focal_px, 0, (width_px - 1) / 2.0, 0, focal_px, (height_px - 1) / 2.0, 0, 0, 1);
  camera.position_mm = {centre_x_mm, centre_y_mm, height_mm};
  return camera;
}

cv::Point2d CameraModel::project(const cv::Vec3d& p_mm) const {
  const cv::Vec3d p = R * (p_mm - position_mm);
  if (!(p[2] > 0)) throw RunError("a point behind the camera has no image; turn the camera towards the floor");
  const cv::Point2d normalised = distorted(distortion, {p[0] / p[2], p[1] / p[2]});
  const cv::Vec3d pixel = K * cv::Vec3d{normalised.x, normalised.y, 1};
  return {pixel[0], pixel[1]};
}

cv::Matx22d CameraModel::jacobian(const cv::Vec3d& p_mm) const {
  constexpr double kStep_mm = 1;
  const cv::Vec3d x{kStep_mm, 0, 0}, y{0, kStep_mm, 0};
  const cv::Point2d along_x = (project(p_mm + x) - project(p_mm - x)) / (2 * kStep_mm);
  const cv::Point2d along_y = (project(p_mm + y) - project(p_mm - y)) / (2 * kStep_mm);
  return {along_x.x, along_y.x, along_x.y, along_y.y};
}

cv::Point2d CameraModel::at_height(const cv::Point2d& pixel, double height_mm) const {
  return ToPlane(*this, height_mm)(pixel);
}

CameraModel::ToPlane::ToPlane(const CameraModel& camera, double height_mm)
    : to_normalised_(camera.K.inv()),
      to_arena_(camera.R.t()),
      position_mm_(camera.position_mm),
      height_mm_(height_mm),
      distortion_(camera.distortion) {}

cv::Point2d CameraModel::ToPlane::operator()(const cv::Point2d& pixel) const {
  const cv::Vec3d normalised = to_normalised_ * cv::Vec3d{pixel.x, pixel.y, 1};
  cv::Point2d seen{normalised[0], normalised[1]};
  if (!distortion_.none()) seen = undistorted(distortion_, seen);
  const cv::Vec3d ray = to_arena_ * cv::Vec3d{seen.x, seen.y, 1};
  const double along = (height_mm_ - position_mm_[2]) / ray[2];
  if (!(along > 0) || !std::isfinite(along)) throw RunError("a pixel of the camera does not show the floor");
  return {position_mm_[0] + along * ray[0], position_mm_[1] + along * ray[1]};
}

double CameraModel::lens_share(const cv::Point2d& pixel) const {
  if (vignetting == 0) return 1;
  const double half_x = (width_px - 1) / 2.0, half_y = (height_px - 1) / 2.0;
  const double dx = pixel.x - half_x, dy = pixel.y - half_y;
  return std::max(0.0, 1 - vignetting * (dx * dx + dy * dy) / (half_x * half_x + half_y * half_y));
}

double CameraModel::room_light(double x_mm, double y_mm) const {
  if (uneven_light == 0) return 1;
  const double along_mm = x_mm * std::cos(light_from_rad) + y_mm * std::sin(light_from_rad);
  return std::max(0.0, 1 + uneven_light * along_mm / kLightReference_mm);
}

}  // namespace kilotwin::cameras

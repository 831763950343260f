#include "clients/track/floor_map.hpp"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace kilotwin::track {
namespace {

cv::Vec3d through(const cv::Matx33d& matrix, double x, double y) { return matrix * cv::Vec3d(x, y, 1); }

}  // namespace

FloorMap FloorMap::scale(const cv::Size& picture, double mm_per_px) {
  const double px_per_mm = 1 / mm_per_px;
  return plane({px_per_mm, 0, 0.5 * (picture.width - 1), 0, -px_per_mm, 0.5 * (picture.height - 1), 0, 0, 1});
}

FloorMap FloorMap::plane(const cv::Matx33d& to_px) {
  FloorMap map;
  map.to_px_ = to_px;
  map.to_mm_ = to_px.inv();
  return map;
}

FloorMap FloorMap::camera(const CameraPose& pose) {
  // The plane at the discs' height, in normalised coordinates of the camera: columns of the rotation, and where z = height is.
  const cv::Matx33d& r = pose.rotation;
  const cv::Vec3d origin = pose.translation_mm + pose.disc_height_mm * cv::Vec3d(r(0, 2), r(1, 2), r(2, 2));
  FloorMap map = plane({r(0, 0), r(0, 1), origin[0], r(1, 0), r(1, 1), origin[1], r(2, 0), r(2, 1), origin[2]});
  map.camera_ = pose;
  return map;
}

FloorPoint FloorMap::floor(const Point& pixel) const {
  double x = pixel.x_px, y = pixel.y_px;
  if (camera_) {
    std::vector<cv::Point2d> points{{x, y}}, ideal;
    cv::undistortPoints(points, ideal, camera_->intrinsic, camera_->distortion, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 40, 1e-9));
    x = ideal[0].x;
    y = ideal[0].y;
  }
  const cv::Vec3d p = through(to_mm_, x, y);
  return {p[0] / p[2], p[1] / p[2]};
}

Point FloorMap::pixel(const FloorPoint& point) const {
  if (camera_) {
    const std::vector<cv::Point3d> points{{point.x_mm, point.y_mm, camera_->disc_height_mm}};
    std::vector<cv::Point2d> pixels;
    cv::Mat rotation;
    cv::Rodrigues(camera_->rotation, rotation);
    cv::projectPoints(points, rotation, camera_->translation_mm, camera_->intrinsic, camera_->distortion, pixels);
    return {pixels[0].x, pixels[0].y};
  }
  const cv::Vec3d p = through(to_px_, point.x_mm, point.y_mm);
  return {p[0] / p[2], p[1] / p[2]};
}

double FloorMap::mm_per_px(const Point& pixel) const {
  const FloorPoint at = floor(pixel), right = floor({pixel.x_px + 1, pixel.y_px}),
                   down = floor({pixel.x_px, pixel.y_px + 1});
  const double area =
      (right.x_mm - at.x_mm) * (down.y_mm - at.y_mm) - (right.y_mm - at.y_mm) * (down.x_mm - at.x_mm);
  return std::sqrt(std::abs(area));
}

Covariance FloorMap::covariance(const Point& pixel, const Covariance& px2) const {
  const FloorPoint at = floor(pixel), right = floor({pixel.x_px + 1, pixel.y_px}),
                   down = floor({pixel.x_px, pixel.y_px + 1});
  const cv::Matx22d jacobian(right.x_mm - at.x_mm, down.x_mm - at.x_mm, right.y_mm - at.y_mm, down.y_mm - at.y_mm);
  const cv::Matx22d on_floor = jacobian * cv::Matx22d(px2.xx, px2.xy, px2.xy, px2.yy) * jacobian.t();
  return {on_floor(0, 0), on_floor(0, 1), on_floor(1, 1)};
}

double FloorMap::floor_direction(const Point& pixel, double direction_rad) const {
  const FloorPoint from = floor(pixel),
                   to = floor({pixel.x_px + std::cos(direction_rad), pixel.y_px - std::sin(direction_rad)});
  return std::atan2(to.y_mm - from.y_mm, to.x_mm - from.x_mm);
}

}  // namespace kilotwin::track

/// FloorMap: from pixels to millimetres at the height of the robots' discs, and back.
///
/// Millimetres have x to the right and y up, as the arena has. Three kinds: a plain scale, a plane (homography), and a camera with
/// lens and pose.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "clients/track/covariance.hpp"
#include "clients/track/edge_circle.hpp"

namespace kilotwin::track {

struct FloorPoint {
  double x_mm = 0, y_mm = 0;
};

/// A camera as cv::calibrateCamera describes it, and the floor frame in it: p_camera = rotation p_floor + translation.
struct CameraPose {
  cv::Matx33d intrinsic = cv::Matx33d::eye();
  cv::Mat distortion;  ///< coefficients in OpenCV's order, as CV_64F; may be empty
  cv::Matx33d rotation = cv::Matx33d::eye();
  cv::Vec3d translation_mm;
  double disc_height_mm = 0;  ///< of the discs above the plane z = 0
};

class FloorMap {
 public:
  /// No calibration: the scale follows from a disc's radius. The origin is the picture's centre.
  [[nodiscard]] static FloorMap scale(const cv::Size& picture, double mm_per_px);
  /// (x_px, y_px, 1) = to_px (x_mm, y_mm, 1), up to a factor.
  [[nodiscard]] static FloorMap plane(const cv::Matx33d& to_px);
  [[nodiscard]] static FloorMap camera(const CameraPose& pose);

  [[nodiscard]] FloorPoint floor(const Point& pixel) const;
  [[nodiscard]] Point pixel(const FloorPoint& point) const;
  /// Scale near a pixel: square root of the area of a pixel, mm.
  [[nodiscard]] double mm_per_px(const Point& pixel) const;
  /// A covariance at a pixel, px^2 with y down, as one on the floor, mm^2.
  [[nodiscard]] Covariance covariance(const Point& pixel, const Covariance& px2) const;
  /// A direction at a pixel, anticlockwise with y up in the picture, as a direction on the floor.
  [[nodiscard]] double floor_direction(const Point& pixel, double direction_rad) const;

  /// The parts, for files: a camera, or else a plane.
  [[nodiscard]] const std::optional<CameraPose>& camera_pose() const { return camera_; }
  [[nodiscard]] const cv::Matx33d& to_px() const { return to_px_; }

 private:
  cv::Matx33d to_px_ = cv::Matx33d::eye(), to_mm_ = cv::Matx33d::eye();
  std::optional<CameraPose> camera_;
};

}  // namespace kilotwin::track

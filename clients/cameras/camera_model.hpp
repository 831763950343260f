/// CameraModel: how points of the arena reach the pixels of one camera, and what the camera does to light.
///
/// Frames: arena W (x right, y up, z from the floor to the ceiling, mm); camera C (x right in the picture, y down, z along the
/// view). p_C = R (p_W - position). A pixel's centre has whole coordinates: (0, 0) is the middle of the top left pixel.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace kilotwin::cameras {

/// Radial (k1, k2, k3) and tangential (p1, p2) distortion after Brown and Conrady, on normalised coordinates: OpenCV's first
/// five coefficients.
struct Distortion {
  double k1 = 0, k2 = 0, k3 = 0, p1 = 0, p2 = 0;
  [[nodiscard]] bool none() const { return k1 == 0 && k2 == 0 && k3 == 0 && p1 == 0 && p2 == 0; }
};

struct CameraModel {
  int width_px = 1920, height_px = 1080;
  cv::Matx33d K = cv::Matx33d::eye();  ///< intrinsic matrix, px
  cv::Matx33d R = cv::Matx33d(1, 0, 0, 0, -1, 0, 0, 0, -1);
  cv::Vec3d position_mm{0, 0, 2000};  ///< of the optical centre, arena frame; z above 0
  Distortion distortion;

  // The camera's effects on light. Brightness is in grey levels 0..255; the defaults are those of a perfect camera.
  double gain = 1;
  double exposure_s = 0;  ///< robots are smeared along their motion over this time, which is centred at the capture
  double blur_px = 0;     ///< standard deviation of the lens' point spread
  double read_noise = 0;  ///< standard deviation of noise in the dark, grey levels
  double shot_noise = 0;  ///< standard deviation at level 255; the variance is proportional to the level
  double vignetting = 0;  ///< share of light lost in the corners, 0..1; grows with the square of the distance
  double uneven_light =
      0;  ///< room light at 1 m from the arena's centre differs by this share from that at the centre
  double light_from_rad = 2.4;  ///< direction of the brighter side
  std::uint64_t seed = 1;       ///< of the noise

  /// A camera that looks straight down at (centre_x_mm, centre_y_mm), which is the middle of the picture.
  [[nodiscard]] static CameraModel overhead(int width_px, int height_px, double px_per_mm, double centre_x_mm = 0,
                                            double centre_y_mm = 0, double height_mm = 2000);

  /// Where a point of the arena appears. Points behind the camera have no image: RunError.
  [[nodiscard]] cv::Point2d project(const cv::Vec3d& p_mm) const;
  /// How the image moves with the point along x and y of the arena, px per mm: columns d/dx and d/dy.
  [[nodiscard]] cv::Matx22d jacobian(const cv::Vec3d& p_mm) const;
  /// The point at `height_mm` above the floor that appears at the pixel. RunError where the pixel shows none.
  [[nodiscard]] cv::Point2d at_height(const cv::Point2d& pixel, double height_mm) const;
  /// The same for many pixels.
  class ToPlane;
  /// The share of light that the lens lets through to a pixel.
  [[nodiscard]] double lens_share(const cv::Point2d& pixel) const;
  /// Room light at a point of the floor, as a multiple of that at the centre.
  [[nodiscard]] double room_light(double x_mm, double y_mm) const;
};

/// From pixels to the points of the plane at one height.
class CameraModel::ToPlane {
 public:
  ToPlane(const CameraModel& camera, double height_mm);
  /// RunError where the pixel shows no point of the plane.
  [[nodiscard]] cv::Point2d operator()(const cv::Point2d& pixel) const;

 private:
  cv::Matx33d to_normalised_, to_arena_;
  cv::Vec3d position_mm_;
  double height_mm_;
  Distortion distortion_;
};

}  // namespace kilotwin::cameras

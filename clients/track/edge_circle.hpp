/// The circle of one robot's disc, fitted to the edges that rays from its centre meet.
///
/// A Kilobot's body is darker than the floor. Along a ray from the centre, brightness rises where the ray leaves the disc. The
/// fit takes the strongest rise of log brightness near the expected radius on every ray and fits a circle to these points by
/// iteratively reweighted least squares. Log brightness makes contrast independent of how brightly a place is lit.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace kilotwin::track {

/// A point of a picture, px: the middle of the first pixel is (0, 0), x to the right, y down.
struct Point {
  double x_px = 0, y_px = 0;
};

struct Circle {
  Point centre;
  double radius_px = 0;
};

/// Rays per circle.
inline constexpr int kRays = 64;

/// A circle with what speaks for it.
struct FittedCircle {
  Circle circle;
  /// Share of the rays that meet an edge of the circle, of those that nothing hides: 0..1.
  double coverage = 0;
  /// Share of all rays that meet an edge of the circle, 0..1.
  double seen = 0;
  /// Median rise of the logarithm of brightness from inside to outside at the edge.
  double contrast = 0;
  /// Root mean square of the edge points' distances from the circle, px.
  double residual_px = 0;
  /// Covariance of the centre, where each edge point has an independent error of variance 1 along its ray.
  cv::Matx22d spread = cv::Matx22d::eye();
};

/// Assumptions of the fit.
struct FitLimits {
  double radius_tolerance = 0.25;  ///< the radius may differ by this share from the guess's
  double least_rise = 0.06;        ///< smallest rise of log brightness across an edge that counts
  std::vector<Circle> neighbours;  ///< discs known nearby: rays towards them may be hidden
};

/// Fits a circle near `guess` to the grey picture. Nothing where too few rays meet an edge, or where the fit leaves the
/// guess's neighbourhood. `grey`: 8 bits, one channel.
[[nodiscard]] std::optional<FittedCircle> fit_circle(const cv::Mat& grey, const Circle& guess,
                                                     const FitLimits& limits);

}  // namespace kilotwin::track

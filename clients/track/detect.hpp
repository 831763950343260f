/// Robots in one picture, without options: their common radius is found from the picture itself.
///
/// docs/explanation/camera-tracker.md states the method: votes of edges for centres, a fitted circle for each candidate, the radius
/// that explains most circles, and no two discs that overlap.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "clients/track/covariance.hpp"
#include "clients/track/edge_circle.hpp"

namespace kilotwin::track {

/// Radii that are searched, px. Smaller discs have too few pixels for a circle to be told from clutter.
inline constexpr double kLeastRadius_px = 5, kMostRadius_px = 90;
/// Below, robots that touch or lie in clutter are missed: docs/results/camera-tracker.md, "Drawn discs".
inline constexpr double kWellSeenRadius_px = 8;

/// Says what is wrong with the size of the robots in the picture, and which size would do; empty where all is well. `radius_px`:
/// of their discs, as found or as the calibration states it; nothing where neither is known.
[[nodiscard]] std::string scale_advice(std::optional<double> radius_px);

/// A robot in one picture.
struct Detection {
  Circle disc;
  double coverage = 0;  ///< share of the visible rim that has an edge, 0..1
  double contrast = 0;  ///< rise of log brightness from the body to the floor
  /// Covariance of the centre, px^2, with y down: docs/explanation/camera-tracker.md, "Errors of a position".
  Covariance error_px2;
};

/// The common appearance of the discs of one camera.
struct Look {
  double radius_px = 0;
  double contrast = 0;  ///< median of the robots'
};

class Detector {
 public:
  /// `radius_px`: where a calibration states it; else the first picture with robots tells.
  explicit Detector(std::optional<double> radius_px = std::nullopt);

  /// All robots of a grey picture of 8 bits, from left to right.
  [[nodiscard]] std::vector<Detection> find(const cv::Mat& grey);
  /// The robot near a predicted centre; `reach_px` is how far it may be from there. Nothing before find() found robots.
  /// `neighbours`: discs of robots nearby.
  [[nodiscard]] std::optional<Detection> find_near(const cv::Mat& grey, const Point& predicted, double reach_px,
                                                   const std::vector<Circle>& neighbours = {}) const;
  /// Robots in a part of the picture of which none is known yet. Nothing before find() found robots.
  [[nodiscard]] std::vector<Detection> find_more(const cv::Mat& grey, const cv::Rect& region,
                                                 const std::vector<Circle>& known) const;
  /// Nothing until robots were found.
  [[nodiscard]] const std::optional<Look>& look() const { return look_; }

 private:
  [[nodiscard]] bool accepts(const FittedCircle& circle) const;

  std::optional<double> known_radius_px_;
  std::optional<Look> look_;
};

}  // namespace kilotwin::track

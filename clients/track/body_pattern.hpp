/// The heading of a robot whose LED is dark, from the pattern of its body: battery holder, legs and parts, seen from above.
///
/// The pattern is the same on all robots of one kind. It is learned from robots that drive straight; lamps and shadows do not turn
/// with the robots, so they vanish from the mean over headings. The heading of a robot is the rotation by which its picture agrees
/// best with the pattern, as in registration by polar correlation.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "clients/track/floor_map.hpp"

namespace kilotwin::track {

/// A robot's disc in polar coordinates on the floor: logarithm of brightness, ring by ring, each with mean 0; the sum of squares
/// is 1. Angles count anticlockwise from the floor's x axis.
class BodyPicture {
 public:
  static constexpr std::size_t kRings = 5, kAngles = 72;
  using Ring = std::array<float, kAngles>;

  /// Of the disc around a pixel. Nothing where it leaves the picture or shows no contrast.
  [[nodiscard]] static std::optional<BodyPicture> of(const cv::Mat& grey, const Point& centre,
                                                     const FloorMap& floor);
  std::array<Ring, kRings> rings{};

 private:
  [[nodiscard]] bool normalise();
};

class BodyPattern {
 public:
  /// A robot whose heading is known from its path.
  void learn(const BodyPicture& picture, double heading_rad);
  /// Nothing before robots with different headings have been learned from, or where no rotation fits clearly best.
  [[nodiscard]] std::optional<double> heading_rad(const BodyPicture& picture) const;

 private:
  std::array<BodyPicture::Ring, BodyPicture::kRings> sum_{};  ///< turned to heading 0
  double count_ = 0, cos_ = 0, sin_ = 0;                      ///< of pictures; of their headings
};

}  // namespace kilotwin::track

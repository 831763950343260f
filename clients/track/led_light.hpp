/// The light in a part of a picture, against the floor: what LEDs add to it.
#pragma once

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "clients/track/edge_circle.hpp"

namespace kilotwin::track {

using Colour = std::array<double, 3>;  // red, green, blue

inline double squared(double value) { return value * value; }
// Not std::hypot(), which is several times slower: coordinates of pixels do not overflow.
inline double distance_px(const Point& a, const Point& b) {
  return std::sqrt(squared(a.x_px - b.x_px) + squared(a.y_px - b.y_px));
}
inline double distance_px(double x_px, double y_px, const Circle& disc) {
  return distance_px(Point{x_px, y_px}, disc.centre);
}

/// Difference of the channels, relative to the floor, above which a pixel has a colour.
inline constexpr double kLeastChroma = 0.16;

/// The light of one robot's surroundings, relative to the floor: a grid with some eight columns per radius.
struct Light {
  int left, top, stride, columns, rows;
  std::vector<Colour> relative;  ///< pixel / floor
  std::vector<double> weight;    ///< how much of the pixel is light of an LED; 0 where another robot is nearer
  std::vector<double> anyones;   ///< the same whoever is nearer
  std::vector<bool> clipped;     ///< the camera is saturated: there is no colour

  [[nodiscard]] Point pixel(int column, int row) const {
    return {static_cast<double>(left + column * stride), static_cast<double>(top + row * stride)};
  }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
};

/// The light nearer to the middle of `disc` than `reach` radii. `others`: discs of the robots nearby.
[[nodiscard]] Light light_around(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others,
                                 double reach);

}  // namespace kilotwin::track

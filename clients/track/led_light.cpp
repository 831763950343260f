#include "clients/track/led_light.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/stats/quantiles.hpp"

namespace kilotwin::track {
namespace {

constexpr double kFloorFrom = 1.35, kFloorTo = 1.8;  ///< the ring in which the floor is seen, radii
/// The floor is looked at no farther from the centre than this, radii, and places so close to another robot's centre are no floor.
constexpr double kFarthestFloor = 3.0, kCovered = 1.25;
constexpr double kGridRadius = 8;  ///< larger discs are looked at with every second pixel, or fewer
/// Excess over the floor, relative to it, above which a pixel is lit.
constexpr double kLeastExcess = 0.15;
/// The dark rim, radii, and the brightness relative to the floor above which it is lit.
constexpr double kRimFrom = 0.72, kRimTo = 0.95, kBrightRim = 0.8;
constexpr double kClipped = 246;  ///< grey level above which a pixel counts as saturated

Colour pixel(const cv::Mat& picture, int row, int column) {
  if (picture.channels() == 1) {
    const double v = picture.at<unsigned char>(row, column);
    return {v, v, v};
  }
  const auto& p = picture.at<cv::Vec3b>(row, column);
  return {static_cast<double>(p[2]), static_cast<double>(p[1]), static_cast<double>(p[0])};
}

constexpr int kFloorAngles = 72, kFloorRadii = 3;  ///< places at which the floor is looked at

/// Unit vectors of the directions in which the floor is looked at.
const std::array<cv::Point2d, kFloorAngles>& floor_directions() {
  static const std::array<cv::Point2d, kFloorAngles> table = [] {
    std::array<cv::Point2d, kFloorAngles> made;
    for (std::size_t i = 0; i < kFloorAngles; ++i) {
      const double angle = 2 * CV_PI * static_cast<double>(i) / kFloorAngles;
      made[i] = {std::cos(angle), std::sin(angle)};
    }
    return made;
  }();
  return table;
}

/// The floor's colour around a robot: the median of each channel, of places that no robot covers.
Colour floor_around(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others) {
  std::array<std::vector<double>, 3> seen;
  const double r = disc.radius_px;
  // The robot that covered a place most likely covers the next one.
  const Circle* last = nullptr;
  const auto is_covered = [&](double x, double y) {
    const auto covers = [x, y](const Circle& other) {
      return squared(x - other.centre.x_px) + squared(y - other.centre.y_px) < squared(kCovered * other.radius_px);
    };
    if (last != nullptr && covers(*last)) return true;
    const auto found = std::find_if(others.begin(), others.end(), covers);
    if (found == others.end()) return false;
    last = &*found;
    return true;
  };
  for (int pass = 0; pass < 2 && seen[0].size() < kFloorAngles / 4; ++pass) {
    const double from = pass == 0 ? kFloorFrom : kFloorTo, to = pass == 0 ? kFloorTo : kFarthestFloor;
    for (const cv::Point2d& direction : floor_directions()) {
      for (int i = 0; i < kFloorRadii; ++i) {
        const double at = r * (from + (to - from) * i / (kFloorRadii - 1));
        const double x = disc.centre.x_px + at * direction.x, y = disc.centre.y_px + at * direction.y;
        const int column = cvRound(x), row = cvRound(y);
        if (column < 0 || row < 0 || column >= picture.cols || row >= picture.rows) continue;
        if (is_covered(x, y)) continue;
        const Colour c = pixel(picture, row, column);
        for (std::size_t k = 0; k < 3; ++k) seen[k].push_back(c[k]);
      }
    }
  }
  Colour floor{};
  for (std::size_t k = 0; k < 3; ++k) {
    // Crowded: the brightest of what there is was hardly a robot.
    if (seen[k].empty()) return {160, 160, 160};
    floor[k] = std::max(12.0, stats::upper_median(std::move(seen[k])));
  }
  return floor;
}

/// For each pixel in a row of the grid, the squared distance from the middle of the nearest other robot, in its radii. Infinite
/// where that is farther than `reach`.
void nearest_in_row(const Light& light, int y, const std::vector<Circle>& others, double reach,
                    std::vector<double>& nearest2) {
  nearest2.assign(static_cast<std::size_t>(light.columns), std::numeric_limits<double>::infinity());
  for (const Circle& other : others) {
    const double within_px = reach * other.radius_px, down_px = light.top + y * light.stride - other.centre.y_px;
    if (std::abs(down_px) > within_px) continue;
    const double middle = (other.centre.x_px - light.left) / light.stride, half = within_px / light.stride;
    const int first = std::max(0, cvCeil(middle - half)),
              last = std::min(light.columns - 1, cvFloor(middle + half));
    const double per_px2 = 1 / squared(other.radius_px);
    for (int x = first; x <= last; ++x) {
      double& nearest = nearest2[static_cast<std::size_t>(x)];
      nearest = std::min(nearest,
                         per_px2 * (squared(light.left + x * light.stride - other.centre.x_px) + squared(down_px)));
    }
  }
}

}  // namespace

Light light_around(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others, double reach) {
  const Colour floor = floor_around(picture, disc, others);
  const double reach_px = reach * disc.radius_px;
  const int left = std::max(0, cvFloor(disc.centre.x_px - reach_px));
  const int top = std::max(0, cvFloor(disc.centre.y_px - reach_px));
  const int right = std::min(picture.cols - 1, cvCeil(disc.centre.x_px + reach_px));
  const int bottom = std::min(picture.rows - 1, cvCeil(disc.centre.y_px + reach_px));
  const int stride = std::max(1, cvRound(disc.radius_px / kGridRadius));
  Light light{
      left, top, stride, std::max(0, (right - left) / stride + 1), std::max(0, (bottom - top) / stride + 1), {},
      {},   {},  {}};
  const auto count = static_cast<std::size_t>(light.columns) * static_cast<std::size_t>(light.rows);
  light.relative.assign(count, Colour{});
  light.weight.assign(count, 0);
  light.anyones.assign(count, 0);
  light.clipped.assign(count, false);
  std::vector<double> nearest2;
  std::size_t i = 0;
  for (int y = 0; y < light.rows; ++y) {
    nearest_in_row(light, y, others, reach, nearest2);
    for (int x = 0; x < light.columns; ++x, ++i) {
      const int row = top + y * stride, column = left + x * stride;
      const double own = distance_px(column, row, disc) / disc.radius_px;
      if (own > reach) continue;
      // Distance from the middle of the robot that is nearest, radii.
      const double nearest = std::min(own, std::sqrt(nearest2[static_cast<std::size_t>(x)]));
      Colour& c = light.relative[i];
      c = pixel(picture, row, column);
      light.clipped[i] = std::min({c[0], c[1], c[2]}) >= kClipped;
      for (std::size_t k = 0; k < 3; ++k) c[k] /= floor[k];
      const auto [least, most] = std::minmax({c[0], c[1], c[2]});
      // A body reflects less than the floor: its tint counts little. In its middle, a dome may mirror a lamp.
      const double tint =
          light.clipped[i] ? 0 : std::max(0.0, (most - least) - kLeastChroma) * std::min(1.0, most / 0.5);
      double excess = nearest > 0.45 ? std::max(0.0, most - 1 - kLeastExcess) : 0;
      // The rim is dark: what is as bright as the floor there is light.
      if (nearest > kRimFrom && nearest < kRimTo) excess = std::max(excess, 2 * (most - kBrightRim));
      light.anyones[i] = std::max(tint, excess);
      light.weight[i] = nearest < own ? 0 : light.anyones[i];
    }
  }
  return light;
}

}  // namespace kilotwin::track

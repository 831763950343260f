/// Geometry of contacts: walls and discs. The free-motion model does not describe a robot in contact. The filter
/// adds contact noise there, and the fit uses no other information from it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/pose.hpp"

namespace kilotwin::identify {

/// Bounds of the disc centres, mm. Infinite: no wall on that side.
struct Walls {
  double x_low_mm = -std::numeric_limits<double>::infinity(), x_high_mm = std::numeric_limits<double>::infinity();
  double y_low_mm = -std::numeric_limits<double>::infinity(), y_high_mm = std::numeric_limits<double>::infinity();

  /// Whether the point is within `margin_mm` of a wall or beyond it.
  [[nodiscard]] bool at_wall(double x_mm, double y_mm, double margin_mm) const {
    return x_mm < x_low_mm + margin_mm || x_mm > x_high_mm - margin_mm || y_mm < y_low_mm + margin_mm ||
           y_mm > y_high_mm - margin_mm;
  }
  /// Number of sides with a wall.
  [[nodiscard]] int sides() const {
    const std::array<double, 4> all = {x_low_mm, x_high_mm, y_low_mm, y_high_mm};
    return static_cast<int>(
        std::count_if(all.begin(), all.end(), [](double side_mm) { return std::isfinite(side_mm); }));
  }
  [[nodiscard]] bool any() const { return sides() > 0; }
  [[nodiscard]] double inside_x(double x_mm) const { return std::clamp(x_mm, x_low_mm, x_high_mm); }
  [[nodiscard]] double inside_y(double y_mm) const { return std::clamp(y_mm, y_low_mm, y_high_mm); }
};

/// Robots with centres this close may be in contact, mm: one diameter of 33 mm, and the motion between samples.
inline constexpr double kContactRange_mm = 36;
inline constexpr double kDiscDiameter_mm = 2 * kRobotRadius_mm;
inline constexpr double kWallMargin_mm = 4;

/// Separates overlapping discs by half the overlap each. Returns whether any overlapped. NaN: the robot is absent.
bool push_apart(std::vector<double>& x_mm, std::vector<double>& y_mm);

}  // namespace kilotwin::identify

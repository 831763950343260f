/// Where robots touch: walls, seen by where robots come to a stop, and each other. What happens to a robot there is nobody's
/// model of a free robot: its way is uncertain while it touches, and nothing is concluded from it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace kilotwin::identify {

/// Centres of discs stay within.
struct Room {
  double x_low_mm = -std::numeric_limits<double>::infinity(), x_high_mm = std::numeric_limits<double>::infinity();
  double y_low_mm = -std::numeric_limits<double>::infinity(), y_high_mm = std::numeric_limits<double>::infinity();

  /// Within so much of a wall, mm.
  [[nodiscard]] bool at_wall(double x_mm, double y_mm, double margin_mm) const {
    return x_mm < x_low_mm + margin_mm || x_mm > x_high_mm - margin_mm || y_mm < y_low_mm + margin_mm ||
           y_mm > y_high_mm - margin_mm;
  }
  [[nodiscard]] bool any() const {
    return std::isfinite(x_low_mm) || std::isfinite(x_high_mm) || std::isfinite(y_low_mm) ||
           std::isfinite(y_high_mm);
  }
  [[nodiscard]] double inside_x(double x_mm) const { return std::clamp(x_mm, x_low_mm, x_high_mm); }
  [[nodiscard]] double inside_y(double y_mm) const { return std::clamp(y_mm, y_low_mm, y_high_mm); }
};

/// Two robots whose centres are this near may touch, mm: two radii of 16.5 mm, and what they move between looks.
inline constexpr double kTouch_mm = 36;
inline constexpr double kDiscs_mm = 33;
inline constexpr double kWallMargin_mm = 4;

/// Pushes overlapping discs apart, half the overlap each; whether any did. NaN: not there.
bool push_apart(std::vector<double>& x_mm, std::vector<double>& y_mm);

}  // namespace kilotwin::identify

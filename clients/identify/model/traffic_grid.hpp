/// Traffic on the floor: the time for which driven robots were in each square cell.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin::identify {

/// A grid of square cells: its cell size and the position of one cell corner, mm.
struct GridCells {
  double side_mm = 50, x_mm = 0, y_mm = 0;
};

class TrafficGrid {
 public:
  /// Positions beyond kReach_mm belong to the outermost cells.
  explicit TrafficGrid(const GridCells& cells) : cells_(cells), half_(std::ceil(kReach_mm / cells.side_mm)) {
    const auto side = static_cast<std::size_t>(2 * half_);
    seconds_.assign(side * side, 0);
  }
  void add(double x_mm, double y_mm, double seconds) { seconds_[cell(x_mm, y_mm)] += static_cast<float>(seconds); }
  [[nodiscard]] float value_s(double x_mm, double y_mm) const { return seconds_[cell(x_mm, y_mm)]; }

 private:
  static constexpr double kReach_mm = 1600;
  [[nodiscard]] std::size_t cell(double x_mm, double y_mm) const {
    const auto index = [&](double c) {
      return static_cast<std::size_t>(std::clamp(std::floor(c / cells_.side_mm) + half_, 0.0, 2 * half_ - 1));
    };
    return index(y_mm - cells_.y_mm) * static_cast<std::size_t>(2 * half_) + index(x_mm - cells_.x_mm);
  }
  GridCells cells_;
  double half_;
  std::vector<float> seconds_;
};

}  // namespace kilotwin::identify

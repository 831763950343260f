/// Traffic on the floor: the time for which driven robots were in each square cell.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin::identify {

/// A grid of square cells: its cell size and the position of one cell corner, mm. Earlier time decays by
/// exp(-age / forget_s); 0: no decay.
struct GridCells {
  double side_mm = 50, x_mm = 0, y_mm = 0, forget_s = 0;
};

class TrafficGrid {
 public:
  /// Positions beyond kReach_mm belong to the outermost cells.
  explicit TrafficGrid(const GridCells& cells) : cells_(cells), half_(std::ceil(kReach_mm / cells.side_mm)) {
    const auto side = static_cast<std::size_t>(2 * half_);
    seconds_.assign(side * side, {});
  }
  /// Times never decrease from call to call.
  void add(double x_mm, double y_mm, double seconds, double now_s = 0) {
    Cell& c = seconds_[cell(x_mm, y_mm)];
    c = {kept(c, now_s) + static_cast<float>(seconds), static_cast<float>(now_s)};
  }
  [[nodiscard]] float value_s(double x_mm, double y_mm, double now_s = 0) const {
    return kept(seconds_[cell(x_mm, y_mm)], now_s);
  }

 private:
  struct Cell {
    float value_s = 0, at_s = 0;
  };
  [[nodiscard]] float kept(const Cell& c, double now_s) const {
    if (cells_.forget_s <= 0 || c.value_s == 0) return c.value_s;
    return c.value_s * std::exp((c.at_s - static_cast<float>(now_s)) / static_cast<float>(cells_.forget_s));
  }
  static constexpr double kReach_mm = 1600;
  [[nodiscard]] std::size_t cell(double x_mm, double y_mm) const {
    const auto index = [&](double c) {
      return static_cast<std::size_t>(std::clamp(std::floor(c / cells_.side_mm) + half_, 0.0, 2 * half_ - 1));
    };
    return index(y_mm - cells_.y_mm) * static_cast<std::size_t>(2 * half_) + index(x_mm - cells_.x_mm);
  }
  GridCells cells_;
  double half_;
  std::vector<Cell> seconds_;
};

}  // namespace kilotwin::identify

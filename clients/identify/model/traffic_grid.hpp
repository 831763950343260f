/// A floor that remembers where driven robots went: in square cells, the time for which they stood there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin::identify {

/// Square cells of a floor: their side, and where a corner of four of them lies.
struct FloorCells {
  double side_mm = 50, x_mm = 0, y_mm = 0;
};

class FloorMemory {
 public:
  /// What is farther away than some metres belongs to the outermost cells.
  explicit FloorMemory(const FloorCells& cells) : cells_(cells), half_(std::ceil(kReach_mm / cells.side_mm)) {
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
  FloorCells cells_;
  double half_;
  std::vector<float> seconds_;
};

}  // namespace kilotwin::identify

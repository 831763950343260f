/// A floor that remembers where driven robots went: in square cells, the time for which they stood there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace kilotwin::identify {

class FloorMemory {
 public:
  /// The corner of four cells lies at 0, 0. What is farther away than some metres belongs to the outermost cells.
  explicit FloorMemory(double cell_mm) : cell_mm_(cell_mm), half_(std::ceil(kReach_mm / cell_mm)) {
    const auto side = static_cast<std::size_t>(2 * half_);
    seconds_.assign(side * side, 0);
  }
  void add(double x_mm, double y_mm, double seconds) { seconds_[cell(x_mm, y_mm)] += static_cast<float>(seconds); }
  [[nodiscard]] float value_s(double x_mm, double y_mm) const { return seconds_[cell(x_mm, y_mm)]; }

 private:
  static constexpr double kReach_mm = 1600;
  [[nodiscard]] std::size_t cell(double x_mm, double y_mm) const {
    const auto index = [&](double c) {
      return static_cast<std::size_t>(std::clamp(std::floor(c / cell_mm_) + half_, 0.0, 2 * half_ - 1));
    };
    return index(y_mm) * static_cast<std::size_t>(2 * half_) + index(x_mm);
  }
  double cell_mm_, half_;
  std::vector<float> seconds_;
};

}  // namespace kilotwin::identify

/// Traffic on the floor: the time for which driven robots were in each square cell, or how fresh the trail of another one is.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace kilotwin::identify {

/// A grid of square cells: its cell size and the position of one cell corner, mm.
struct GridCells {
  double side_mm = 50, x_mm = 0, y_mm = 0;
  double forget_s = 0;  ///< earlier time decays by exp(-age / forget_s); 0: no decay
  /// The value is exp(-age / forget_s), with the time since a driven robot other than the reading one was in the cell.
  bool trail = false;
};

class TrafficGrid {
 public:
  /// Positions beyond kReach_mm belong to the outermost cells.
  explicit TrafficGrid(const GridCells& cells) : cells_(cells), half_(std::ceil(kReach_mm / cells.side_mm)) {
    const auto side = static_cast<std::size_t>(2 * half_);
    contents_.assign(side * side * (cells.trail ? 2 : 1), {});
  }
  /// A driven robot was there for some seconds.
  void add(std::size_t robot, double x_mm, double y_mm, double seconds, double now_s = 0) {
    Content* const c = &contents_[cell(x_mm, y_mm)];
    const Content passage{key(robot), static_cast<float>(now_s)};
    if (cells_.trail)
      pass(c, passage);
    else
      *c = {kept(*c, now_s) + static_cast<float>(seconds), passage.at_s};
  }
  /// The covariate of a robot there: seconds, or the freshness of a trail.
  [[nodiscard]] float value(std::size_t robot, double x_mm, double y_mm, double now_s = 0) const {
    const Content* const c = &contents_[cell(x_mm, y_mm)];
    if (!cells_.trail) return kept(*c, now_s);
    const Content& other = c[c->value == key(robot) ? 1 : 0];
    return other.value == 0 ? 0.0F : faded(1, other.at_s, now_s);
  }

 private:
  /// A trail has two per cell: the two robots that passed last, the later one first, by their keys.
  struct Content {
    float value = 0, at_s = 0;
  };
  /// Robots may come in any order: gaps of their tracks are filled later.
  static void pass(Content* c, const Content& passage) {
    const std::size_t own = c[0].value == passage.value ? 0 : 1;
    if (c[1].value != 0 && c[own].value != passage.value && passage.at_s < c[1].at_s) return;
    if (c[own].value != passage.value || passage.at_s > c[own].at_s) c[own] = passage;
    if (c[1].value != 0 && (c[0].value == 0 || c[1].at_s >= c[0].at_s)) std::swap(c[0], c[1]);
  }
  [[nodiscard]] static float key(std::size_t robot) { return static_cast<float>(robot + 1); }
  [[nodiscard]] float faded(float value, float at_s, double now_s) const {
    return value * std::exp((at_s - static_cast<float>(now_s)) / static_cast<float>(cells_.forget_s));
  }
  [[nodiscard]] float kept(const Content& c, double now_s) const {
    return cells_.forget_s <= 0 || c.value == 0 ? c.value : faded(c.value, c.at_s, now_s);
  }
  /// Distance from the middle to the sides. Places beyond count in the outermost cells; a larger value costs memory by the
  /// square.
  static constexpr double kReach_mm = 1600;
  /// Index of the first content of a cell.
  [[nodiscard]] std::size_t cell(double x_mm, double y_mm) const {
    const auto index = [&](double c) {
      return static_cast<std::size_t>(std::clamp(std::floor(c / cells_.side_mm) + half_, 0.0, 2 * half_ - 1));
    };
    const std::size_t number =
        index(y_mm - cells_.y_mm) * static_cast<std::size_t>(2 * half_) + index(x_mm - cells_.x_mm);
    return cells_.trail ? 2 * number : number;
  }
  GridCells cells_;
  double half_;
  std::vector<Content> contents_;
};

}  // namespace kilotwin::identify

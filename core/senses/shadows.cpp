#include "core/senses/shadows.hpp"

#include <algorithm>

#include "core/base/pose.hpp"

namespace kilotwin::senses {
namespace {

/// Upper limit of the number of cells. Cells are also at least as wide as a body.
constexpr double kCellsPerBody = 2;

/// Index 0..count-1 of the cell at coordinate `at`, which is in cell widths. Coordinates outside belong to the outermost cells.
std::uint32_t cell(double at, std::uint32_t count) {
  return !(at > 0) ? 0 : at < count ? static_cast<std::uint32_t>(at) : count - 1;
}

}  // namespace

void Shadows::prepare(const std::vector<double>& x_mm, const std::vector<double>& y_mm) {
  x_mm_ = &x_mm;
  y_mm_ = &y_mm;
  if (x_mm.empty()) {
    columns_ = rows_ = 0;
    return;
  }
  const auto [x_min, x_max] = std::minmax_element(x_mm.begin(), x_mm.end());
  const auto [y_min, y_max] = std::minmax_element(y_mm.begin(), y_mm.end());
  left_mm_ = *x_min;
  bottom_mm_ = *y_min;
  const double width_mm = *x_max - *x_min, height_mm = *y_max - *y_min;
  const double most = kCellsPerBody * static_cast<double>(x_mm.size()) + 1;
  cell_mm_ =
      std::max({2 * kRobotRadius_mm, __builtin_sqrt(width_mm * height_mm / most), (width_mm + height_mm) / most});
  columns_ = static_cast<std::uint32_t>(width_mm / cell_mm_) + 1;
  rows_ = static_cast<std::uint32_t>(height_mm / cell_mm_) + 1;

  // Counting sort by cell. Within a cell, bodies stand in ascending order.
  first_.assign(std::size_t{columns_} * rows_ + 1, 0);
  cell_of_.resize(x_mm.size());
  body_.resize(x_mm.size());
  for (std::size_t i = 0; i < x_mm.size(); ++i) {
    cell_of_[i] =
        cell((y_mm[i] - bottom_mm_) / cell_mm_, rows_) * columns_ + cell((x_mm[i] - left_mm_) / cell_mm_, columns_);
    ++first_[cell_of_[i] + 1];
  }
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  for (std::size_t i = x_mm.size(); i-- > 0;) body_[--first_[cell_of_[i] + 1]] = static_cast<std::uint32_t>(i);
  // After the loop first_[c + 1] is the start of cell c, so shift by one.
  first_.erase(first_.begin());
  first_.push_back(static_cast<std::uint32_t>(x_mm.size()));
}

bool Shadows::hides(const Lamp& lamp, double x_mm, double y_mm, double z_mm, std::uint32_t self) const {
  if (z_mm >= height_mm_ || columns_ == 0) return false;
  // Fraction of the line, from the sensor, that lies below the tops of the bodies.
  const double part = lamp.z_mm > height_mm_ ? (height_mm_ - z_mm) / (lamp.z_mm - z_mm) : 1;
  const double dx = part * (lamp.x_mm - x_mm), dy = part * (lamp.y_mm - y_mm), square = dx * dx + dy * dy;

  const double low_x = std::min(x_mm, x_mm + dx), high_x = std::max(x_mm, x_mm + dx);
  const double reach = kRobotRadius_mm;
  const std::uint32_t from = cell((low_x - reach - left_mm_) / cell_mm_, columns_),
                      to = cell((high_x + reach - left_mm_) / cell_mm_, columns_);
  for (std::uint32_t column = from; column <= to; ++column) {
    // Range of the line's y where a body of this column can touch the line.
    double y0 = y_mm, y1 = y_mm + dy;
    if (dx != 0) {
      const double x0 = left_mm_ + cell_mm_ * column - reach, x1 = x0 + cell_mm_ + 2 * reach;
      const double s0 = column == 0 ? 0 : (std::clamp(x0, low_x, high_x) - x_mm) / dx,
                   s1 = column + 1 == columns_ ? (dx > 0 ? 1 : 0) : (std::clamp(x1, low_x, high_x) - x_mm) / dx;
      if (column != 0)
        y0 = y_mm + s0 * dy;
      else
        y0 = y_mm + (dx > 0 ? 0 : 1) * dy;
      y1 = y_mm + s1 * dy;
    }
    const std::uint32_t bottom = cell((std::min(y0, y1) - reach - bottom_mm_) / cell_mm_, rows_),
                        top = cell((std::max(y0, y1) + reach - bottom_mm_) / cell_mm_, rows_);
    for (std::uint32_t row = bottom; row <= top; ++row) {
      const std::size_t c = std::size_t{row} * columns_ + column;
      for (std::uint32_t n = first_[c]; n < first_[c + 1]; ++n) {
        const std::uint32_t body = body_[n];
        if (body == self) continue;
        const double bx = (*x_mm_)[body] - x_mm, by = (*y_mm_)[body] - y_mm;
        double s = square > 0 ? (bx * dx + by * dy) / square : 0;
        s = s < 0 ? 0 : s > 1 ? 1 : s;
        const double ex = bx - s * dx, ey = by - s * dy;
        if (ex * ex + ey * ey < reach * reach) return true;
      }
    }
  }
  return false;
}

}  // namespace kilotwin::senses

#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {
namespace {

/// Ratio of the cell size to the range. It exceeds 1, so that rounding of a coordinate cannot put two robots in range of
/// each other two cells apart.
constexpr double kCellSlack = 1 + 1e-6;
/// At least eight cells per side, so that the 5 x 5 cells around a robot are distinct.
constexpr std::uint32_t kLeastSideBits = 3;
/// Robots per cell of the table: in typical experiments several robots are within range of each other.
constexpr std::uint32_t kRobotsPerCell = 4;

}  // namespace

Neighbourhood::Neighbourhood(double range_mm, double cell_mm, std::uint32_t robots)
    : range_square_(range_mm * range_mm),
      cells_per_mm_(1 / (cell_mm * kCellSlack)),
      side_bits_(kLeastSideBits),
      x_mm_(robots),
      y_mm_(robots),
      cell_of_(robots),
      sorted_(robots),
      sorted_x_mm_(robots),
      sorted_y_mm_(robots) {
  while (cells() < robots / kRobotsPerCell) ++side_bits_;
  mask_ = (1u << side_bits_) - 1;
}

void Neighbourhood::sort() {
  if (sorted_now_) return;
  sorted_now_ = true;
  const auto robots = static_cast<std::uint32_t>(x_mm_.size());
  first_.assign(cells() + 1, 0);
  for (std::uint32_t i = 0; i < robots; ++i) {
    cell_of_[i] = cell_of(i);
    ++first_[cell_of_[i]];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& f : first_) {
    sum += f;
    f = sum;
  }
  // In descending order, so that robots within a cell ascend, and first_ ends at the first robot of each cell.
  for (std::uint32_t i = robots; i-- > 0;) {
    const std::uint32_t place = --first_[cell_of_[i]];
    sorted_[place] = i;
    sorted_x_mm_[place] = x_mm_[i];
    sorted_y_mm_[place] = y_mm_[i];
  }
}

double Neighbourhood::bodies_between(std::uint32_t a, std::uint32_t b, double radius_mm) const {
  const double x = x_mm_[a], y = y_mm_[a];
  const double length = __builtin_sqrt(square(a, b));
  if (!(length > 0)) return 0;
  const double ahead_x = (x_mm_[b] - x) / length, ahead_y = (y_mm_[b] - y) / length;
  const auto first = [&](double from, double to) { return coordinate(std::min(from, to) - radius_mm); };
  const auto last = [&](double from, double to) { return coordinate(std::max(from, to) + radius_mm); };
  double sum = 0;
  for (std::uint32_t r = first(y, y_mm_[b]); r != last(y, y_mm_[b]) + 1; ++r) {
    for (std::uint32_t c = first(x, x_mm_[b]); c != last(x, x_mm_[b]) + 1; ++c) {
      const std::uint32_t cell = (r & mask_) << side_bits_ | (c & mask_);
      for (std::uint32_t m = first_[cell]; m < first_[cell + 1]; ++m) {
        const double dx = sorted_x_mm_[m] - x, dy = sorted_y_mm_[m] - y;
        const double along = dx * ahead_x + dy * ahead_y, aside = dx * ahead_y - dy * ahead_x;
        const double half_square = radius_mm * radius_mm - aside * aside;
        if (!(half_square > 0) || along <= 0 || along >= length || sorted_[m] == a || sorted_[m] == b) continue;
        sum += __builtin_sqrt(half_square) / radius_mm;
      }
    }
  }
  return sum;
}

}  // namespace kilotwin::comm

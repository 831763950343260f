#include "core/spatial/cell_list.hpp"

#include <algorithm>

namespace kilotwin {
namespace {

/// Ratio of the cell size to the cutoff. It exceeds 1, so that rounding of a coordinate cannot put two bodies within the
/// cutoff two cells apart.
constexpr double kCellSlack = 1 + 1e-6;
/// Coordinates are clamped to +-this value, mm; arenas are at most 1e6 mm wide.
constexpr double kFar_mm = 1e7;

}  // namespace

CellList::CellList(double cutoff_mm)
    : cutoff_square_mm2_(cutoff_mm * cutoff_mm), cells_per_mm_(1 / (cutoff_mm * kCellSlack)) {}

inline std::uint32_t CellList::coordinate(double mm) const {
  const double clamped = std::min(std::max(mm, -kFar_mm), kFar_mm);
  // The offset makes the value positive, so that the conversion rounds down.
  return static_cast<std::uint32_t>(static_cast<std::int32_t>((clamped + kFar_mm) * cells_per_mm_));
}

void CellList::build(std::span<const double> x_mm, std::span<const double> y_mm) {
  const std::size_t count = x_mm.size();
  side_bits_ = 2;
  while ((std::size_t{1} << (2 * side_bits_)) < 2 * count) ++side_bits_;
  mask_ = (1u << side_bits_) - 1;

  first_.assign((std::size_t{1} << (2 * side_bits_)) + 1, 0);
  cell_of_.resize(count);
  body_.resize(count);
  x_mm_.resize(count);
  y_mm_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t cell = (coordinate(y_mm[i]) & mask_) << side_bits_ | (coordinate(x_mm[i]) & mask_);
    cell_of_[i] = cell;
    ++first_[cell];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& f : first_) {
    sum += f;
    f = sum;
  }
  // In descending order, so that bodies within a cell ascend, and first_ ends at the first body of each cell.
  for (std::size_t i = count; i-- > 0;) {
    const std::uint32_t place = --first_[cell_of_[i]];
    body_[place] = static_cast<std::uint32_t>(i);
    x_mm_[place] = x_mm[i];
    y_mm_[place] = y_mm[i];
  }
}

std::size_t CellList::find(double x_mm, double y_mm, std::uint32_t self, std::vector<std::uint32_t>& found) const {
  if (found.size() <= body_.size()) found.resize(2 * body_.size());
  std::size_t count = 0;
  std::uint32_t* const into = found.data();
  const auto scan = [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t m = begin; m < end; ++m) {
      const double dx = x_mm_[m] - x_mm, dy = y_mm_[m] - y_mm;
      into[count] = body_[m];
      count += static_cast<std::size_t>((dx * dx + dy * dy <= cutoff_square_mm2_) & (body_[m] != self));
    }
  };
  const std::uint32_t column = coordinate(x_mm) & mask_, row = coordinate(y_mm);
  const bool folded = column == 0 || column == mask_;
  for (std::uint32_t r = row - 1; r != row + 2; ++r) {
    const std::uint32_t line = (r & mask_) << side_bits_;
    if (!folded) {
      scan(first_[line + column - 1], first_[line + column + 2]);
    } else {
      for (std::uint32_t c = column - 1; c != column + 2; ++c)
        scan(first_[line + (c & mask_)], first_[line + (c & mask_) + 1]);
    }
  }
  // Insertion sort: few entries, almost sorted.
  for (std::size_t i = 1; i < count; ++i) {
    const std::uint32_t body = found[i];
    std::size_t k = i;
    for (; k > 0 && found[k - 1] > body; --k) found[k] = found[k - 1];
    found[k] = body;
  }
  return count;
}

}  // namespace kilotwin

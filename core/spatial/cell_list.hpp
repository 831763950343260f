/// Neighbour search: bodies sorted by the cells of a square grid, ascending within a cell. The grid covers the plane and is
/// folded onto a table of 2^k x 2^k cells, so that memory depends on the number of bodies only. Bodies far apart may share a
/// cell; distances separate them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kilotwin {

class CellList {
 public:
  /// For searches up to `cutoff_mm`.
  explicit CellList(double cutoff_mm);

  /// Sorts the bodies. Coordinates beyond 10^7 mm share the outermost cells.
  void build(std::span<const double> x_mm, std::span<const double> y_mm);

  /// Writes the bodies whose centres lie within the cutoff of (x, y), without `self`, to `found` in ascending order. Returns
  /// their number; `found` may have more entries.
  std::size_t find(double x_mm, double y_mm, std::uint32_t self, std::vector<std::uint32_t>& found) const;

 private:
  [[nodiscard]] std::uint32_t coordinate(double mm) const;

  double cutoff_square_mm2_, cells_per_mm_;
  std::uint32_t side_bits_ = 0, mask_ = 0;
  std::vector<std::uint32_t> first_;    ///< per cell: index of its first body in body_; then the total
  std::vector<std::uint32_t> cell_of_;  ///< per body
  std::vector<std::uint32_t> body_;     ///< sorted by cell
  std::vector<double> x_mm_, y_mm_;     ///< in the order of body_
};

}  // namespace kilotwin

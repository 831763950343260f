/// Neighbour search: robots in the cells of a square grid whose pitch is the range or slightly more. The grid covers the
/// plane and is folded onto a table of 2^k x 2^k cells, so that memory depends on the number of robots only. Robots far
/// apart may share a cell; distances separate them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace kilotwin::comm {

class Neighbourhood {
 public:
  /// `cell_mm`: pitch of the cells, at least the range.
  Neighbourhood(double range_mm, double cell_mm, std::uint32_t robots);

  /// Sets a robot's position. Returns whether it differs from the previous one.
  bool place(std::uint32_t robot, double x_mm, double y_mm) {
    const bool moved = x_mm_[robot] != x_mm || y_mm_[robot] != y_mm;
    x_mm_[robot] = x_mm;
    y_mm_[robot] = y_mm;
    sorted_now_ = sorted_now_ && !moved;
    return moved;
  }
  /// Sorts the robots by cell, for visit(). Call it when all are placed.
  void sort();

  [[nodiscard]] std::uint32_t robots() const { return static_cast<std::uint32_t>(x_mm_.size()); }
  [[nodiscard]] double x_mm(std::uint32_t robot) const { return x_mm_[robot]; }
  [[nodiscard]] double y_mm(std::uint32_t robot) const { return y_mm_[robot]; }
  /// Squared distance of two robots' centres, mm^2; the same bits for either order.
  [[nodiscard]] double square(std::uint32_t a, std::uint32_t b) const {
    const double dx = x_mm_[a] - x_mm_[b], dy = y_mm_[a] - y_mm_[b];
    return dx * dx + dy * dy;
  }
  [[nodiscard]] bool in_range(std::uint32_t a, std::uint32_t b) const { return square(a, b) <= range_square_; }
  [[nodiscard]] double range_square() const { return range_square_; }

  /// Calls f(other, squared distance) for every other robot in range, in no particular order.
  template <class F> void visit(std::uint32_t robot, F f) const {
    const double x = x_mm_[robot], y = y_mm_[robot];
    const auto scan = [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t m = begin; m < end; ++m) {
        const double dx = sorted_x_mm_[m] - x, dy = sorted_y_mm_[m] - y;
        const double square = dx * dx + dy * dy;
        if (square <= range_square_ && sorted_[m] != robot) f(sorted_[m], square);
      }
    };
    const std::uint32_t column = coordinate(x) & mask_, row = coordinate(y);
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
  }

  /// Length of the line between two robots' centres within the discs of others, in diameters. Call sort() first.
  [[nodiscard]] double bodies_between(std::uint32_t a, std::uint32_t b, double radius_mm) const;

  /// Number of cells.
  [[nodiscard]] std::uint32_t cells() const { return 1u << (2 * side_bits_); }
  [[nodiscard]] std::uint32_t cell_of(std::uint32_t robot) const { return cell_of(x_mm_[robot], y_mm_[robot]); }
  /// Calls f(cell) for all cells within `ranges` (1 or 2) ranges of a robot.
  template <class F> void visit_cells(std::uint32_t robot, std::uint32_t ranges, F f) const {
    const std::uint32_t column = coordinate(x_mm_[robot]), row = coordinate(y_mm_[robot]);
    for (std::uint32_t r = row - ranges; r != row + ranges + 1; ++r) {
      for (std::uint32_t c = column - ranges; c != column + ranges + 1; ++c) {
        f((r & mask_) << side_bits_ | (c & mask_));
      }
    }
  }

 private:
  /// Coordinates are clamped to +-this value, mm; arenas are at most 1e6 mm wide.
  static constexpr double kFar_mm = 1e7;

  [[nodiscard]] std::uint32_t coordinate(double mm) const {
    // The offset makes the value positive, so that the conversion rounds down.
    return static_cast<std::uint32_t>(
        static_cast<std::int32_t>((std::min(std::max(mm, -kFar_mm), kFar_mm) + kFar_mm) * cells_per_mm_));
  }
  [[nodiscard]] std::uint32_t cell_of(double x_mm, double y_mm) const {
    return (coordinate(y_mm) & mask_) << side_bits_ | (coordinate(x_mm) & mask_);
  }

  double range_square_, cells_per_mm_;
  bool sorted_now_ = false;
  std::uint32_t side_bits_, mask_;
  std::vector<double> x_mm_, y_mm_;     ///< per robot
  std::vector<std::uint32_t> cell_of_;  ///< per robot
  std::vector<std::uint32_t> first_;    ///< per cell: index of its first robot in sorted_; then the total
  std::vector<std::uint32_t> sorted_;   ///< robots by cell
  std::vector<double> sorted_x_mm_, sorted_y_mm_;  ///< positions of sorted_
};

}  // namespace kilotwin::comm

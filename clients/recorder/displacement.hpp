/// Displacements of robots.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace kilotwin::recorder {

/// Distances of robots from their first recorded positions. Every state must have the same robots.
class DisplacementObserver {
 public:
  void add(std::span<const double> x_mm, std::span<const double> y_mm);
  /// From now on the robot does not count: it is a cell of a Kilogrid, which never moves.
  void leave_out(std::size_t robot);
  /// Distances between first and last position; 0 before the second state.
  [[nodiscard]] double mean_distance_mm() const { return mean_distance_mm_; }
  [[nodiscard]] double max_distance_mm() const { return max_distance_mm_; }

 private:
  std::vector<double> start_x_mm_, start_y_mm_;
  std::vector<std::uint8_t> left_out_;  ///< per robot; robots beyond the end count
  double mean_distance_mm_ = 0, max_distance_mm_ = 0;
};

}  // namespace kilotwin::recorder

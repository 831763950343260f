/// Displacements of robots.
#pragma once

#include <span>
#include <vector>

namespace kilotwin::recorder {

/// Distances of robots from their first recorded positions. Every state must have the same robots.
class DisplacementObserver {
 public:
  void add(std::span<const double> x_mm, std::span<const double> y_mm);
  /// Distances between first and last position; 0 before the second state.
  [[nodiscard]] double mean_distance_mm() const { return mean_distance_mm_; }
  [[nodiscard]] double max_distance_mm() const { return max_distance_mm_; }

 private:
  std::vector<double> start_x_mm_, start_y_mm_;
  double mean_distance_mm_ = 0, max_distance_mm_ = 0;
};

}  // namespace kilotwin::recorder

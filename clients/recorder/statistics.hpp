/// Statistics over runs or robots: means with standard errors, and displacements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace kilotwin::recorder {

/// Mean and standard deviation, updated per value (Welford 1962: no cancellation).
class Sample {
 public:
  void add(double value);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean() const { return mean_; }  ///< 0 without values
  /// With n - 1 in the denominator; 0 for fewer than two values.
  [[nodiscard]] double standard_deviation() const;
  /// Standard error of the mean: standard deviation / sqrt(n); 0 for fewer than two values.
  [[nodiscard]] double standard_error() const;

 private:
  std::size_t count_ = 0;
  double mean_ = 0, squares_ = 0;
};

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

/// What a sweep tells of many runs or robots: means with standard errors, and the mean square displacement.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// Mean and spread of values as they come (Welford's recurrence: no cancellation).
class Sample {
 public:
  void add(double value);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean() const { return mean_; }  ///< 0 without values
  /// With n - 1 in the denominator; 0 for fewer than two values.
  [[nodiscard]] double standard_deviation() const;
  /// Of the mean: standard deviation / sqrt(n); 0 for fewer than two values, which say nothing of it.
  [[nodiscard]] double standard_error() const;

 private:
  std::size_t count_ = 0;
  double mean_ = 0, squares_ = 0;
};

/// Mean over robots of the squared distance from where each was in the first state, over time since that state.
struct MeanSquareDisplacement {
  std::vector<double> time_s;
  std::vector<double> msd_mm2;
  std::vector<double> standard_error_mm2;  ///< over robots, taken as independent
};

/// Collects it state by state; every state has the same robots.
class DisplacementObserver {
 public:
  void add(double time_s, std::span<const double> x_mm, std::span<const double> y_mm);
  [[nodiscard]] const MeanSquareDisplacement& msd() const { return msd_; }
  /// Distances between first and last place; 0 before the second state.
  [[nodiscard]] double mean_distance_mm() const { return mean_distance_mm_; }
  [[nodiscard]] double max_distance_mm() const { return max_distance_mm_; }

 private:
  std::vector<double> start_x_mm_, start_y_mm_;
  double start_s_ = 0, mean_distance_mm_ = 0, max_distance_mm_ = 0;
  MeanSquareDisplacement msd_;
};

/// Of all states that remain in a recording.
[[nodiscard]] MeanSquareDisplacement mean_square_displacement(Reader& recording);

}  // namespace kilotwin::recorder

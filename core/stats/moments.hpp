/// Mean and standard deviation of a sample.
#pragma once

#include <cmath>
#include <cstddef>

namespace kilotwin::stats {

/// Updated per value (Welford 1962: no cancellation).
class Moments {
 public:
  void add(double value) {
    ++count_;
    const double above = value - mean_;
    mean_ += above / static_cast<double>(count_);
    squares_ += above * (value - mean_);
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean() const { return mean_; }  ///< 0 without values
  /// With n - 1 in the denominator; 0 for fewer than two values.
  [[nodiscard]] double standard_deviation() const {
    return count_ < 2 ? 0 : std::sqrt(squares_ / static_cast<double>(count_ - 1));
  }
  /// Of the mean: standard deviation / sqrt(n); 0 for fewer than two values.
  [[nodiscard]] double standard_error() const {
    return count_ < 2 ? 0 : standard_deviation() / std::sqrt(static_cast<double>(count_));
  }

 private:
  std::size_t count_ = 0;
  double mean_ = 0, squares_ = 0;
};

}  // namespace kilotwin::stats

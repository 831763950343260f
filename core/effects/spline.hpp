/// Natural cubic splines in one and two variables. Beyond the outermost knots they are constant.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace kilotwin {

/// Second derivatives at the knots of the natural cubic spline through (knot, value); they are 0 at both ends. At least two
/// knots, ascending.
[[nodiscard]] std::vector<double> spline_curvatures(std::span<const double> knots, std::span<const double> values);

/// Interval of c among the knots, and the weights of values and second derivatives at its two ends.
struct SplinePlace {
  std::size_t index;          ///< of the interval's lower knot
  double value[2], curve[2];  ///< weights at the lower and at the upper knot
};
[[nodiscard]] SplinePlace spline_place(std::span<const double> knots, double c);

class Spline {
 public:
  Spline(std::vector<double> knots, std::vector<double> values);
  [[nodiscard]] double operator()(double c) const;
  [[nodiscard]] std::span<const double> knots() const { return knots_; }

 private:
  std::vector<double> knots_, values_, curvatures_;
};

class Spline2d {
 public:
  /// values[j * first.size() + i] is the value at (first[i], second[j]).
  Spline2d(std::vector<double> first, std::vector<double> second, std::vector<double> values);
  [[nodiscard]] double operator()(double c, double d) const;
  [[nodiscard]] std::span<const double> first_knots() const { return first_; }
  [[nodiscard]] std::span<const double> second_knots() const { return second_; }

 private:
  std::vector<double> first_, second_;
  /// Per pair of knots: the value, its second derivatives along each variable, and the mixed fourth derivative.
  struct Node {
    double value, along_first, along_second, along_both;
  };
  std::vector<Node> nodes_;
};

}  // namespace kilotwin

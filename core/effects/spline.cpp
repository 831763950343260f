#include "core/effects/spline.hpp"

#include <algorithm>

namespace kilotwin {

std::vector<double> spline_curvatures(std::span<const double> knots, std::span<const double> values) {
  const std::size_t n = knots.size();
  std::vector<double> curvature(n, 0);
  // A tridiagonal, diagonally dominant system: forward elimination, back substitution.
  std::vector<double> ratio(n, 0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = knots[i] - knots[i - 1], after = knots[i + 1] - knots[i];
    const double bend = 6 * ((values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before);
    const double pivot = 2 * (before + after) - before * ratio[i - 1];
    ratio[i] = after / pivot;
    curvature[i] = (bend - before * curvature[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) curvature[i] -= ratio[i] * curvature[i + 1];
  return curvature;
}

SplinePlace spline_place(std::span<const double> knots, double c) {
  const std::size_t last = knots.size() - 1;
  if (!(c > knots[0])) return {0, {1, 0}, {0, 0}};
  if (!(c < knots[last])) return {last - 1, {0, 1}, {0, 0}};
  const auto above = std::upper_bound(knots.begin() + 1, knots.end() - 1, c);
  const auto i = static_cast<std::size_t>(above - knots.begin()) - 1;
  const double width = knots[i + 1] - knots[i], b = (c - knots[i]) / width, a = 1 - b;
  const double sixth = width * width * (1.0 / 6);
  return {i, {a, b}, {(a * a * a - a) * sixth, (b * b * b - b) * sixth}};
}

Spline::Spline(std::vector<double> knots, std::vector<double> values)
    : knots_(std::move(knots)), values_(std::move(values)), curvatures_(spline_curvatures(knots_, values_)) {}

double Spline::operator()(double c) const {
  const SplinePlace at = spline_place(knots_, c);
  const std::size_t i = at.index;
  return at.value[0] * values_[i] + at.value[1] * values_[i + 1] +
         (at.curve[0] * curvatures_[i] + at.curve[1] * curvatures_[i + 1]);
}

Spline2d::Spline2d(std::vector<double> first, std::vector<double> second, std::vector<double> values)
    : first_(std::move(first)), second_(std::move(second)), nodes_(values.size()) {
  const std::size_t columns = first_.size(), rows = second_.size();
  // Curvatures along the first variable in each row; then curvatures of these and of the values along each column.
  std::vector<double> along_first(values.size());
  for (std::size_t j = 0; j < rows; ++j) {
    const auto row = spline_curvatures(first_, std::span(values).subspan(j * columns, columns));
    std::copy(row.begin(), row.end(), along_first.begin() + static_cast<std::ptrdiff_t>(j * columns));
  }
  std::vector<double> value_column(rows), curve_column(rows);
  for (std::size_t i = 0; i < columns; ++i) {
    for (std::size_t j = 0; j < rows; ++j) {
      value_column[j] = values[j * columns + i];
      curve_column[j] = along_first[j * columns + i];
    }
    const auto along_second = spline_curvatures(second_, value_column);
    const auto along_both = spline_curvatures(second_, curve_column);
    for (std::size_t j = 0; j < rows; ++j) {
      nodes_[j * columns + i] = {value_column[j], curve_column[j], along_second[j], along_both[j]};
    }
  }
}

double Spline2d::operator()(double c, double d) const {
  const SplinePlace x = spline_place(first_, c), y = spline_place(second_, d);
  double sum = 0;
  for (std::size_t j = 0; j < 2; ++j) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Node& node = nodes_[(y.index + j) * first_.size() + x.index + i];
      sum += y.value[j] * (x.value[i] * node.value + x.curve[i] * node.along_first) +
             y.curve[j] * (x.value[i] * node.along_second + x.curve[i] * node.along_both);
    }
  }
  return sum;
}

}  // namespace kilotwin

#include "clients/identify/noise_band.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

using proto::Function;

/// The values that a function is written with.
std::vector<double> values_of(const Function& f) {
  if (f.has_table()) return {f.table().value().begin(), f.table().value().end()};
  if (f.has_spline()) return {f.spline().value().begin(), f.spline().value().end()};
  if (f.has_spline_2d()) return {f.spline_2d().value().begin(), f.spline_2d().value().end()};
  if (f.has_steps()) return {f.steps().value().begin(), f.steps().value().end()};
  return {};
}

JsonList places_of(const Function& f) {
  if (f.has_table()) return json_list(f.table().key());
  if (f.has_spline()) return json_list(f.spline().knot());
  // The first value of steps holds before all of them.
  JsonList at;
  if (f.has_steps()) {
    *at.add_values() = json_null();
    for (const double step : f.steps().at()) *at.add_values() = json_value(step);
  }
  for (const double y : f.spline_2d().and_knot())
    for (const double x : f.spline_2d().knot()) *at.add_values() = json_value(json_list(std::vector{x, y}));
  return at;
}

JsonValue axis_of(Function::Covariate of) {
  std::string name = Function::Covariate_Name(of);
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  JsonValue axis;
  (*axis.mutable_struct_value()->mutable_fields())["of"] = json_value(name);
  return axis;
}

}  // namespace

JsonValue noise_band_of(const std::function<Function(const Eigen::VectorXd&)>& scale,
                        const Eigen::VectorXd& coefficients, const Eigen::MatrixXd& covariance) {
  const Function fitted = scale(coefficients);
  const std::vector<double> values = values_of(fitted);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solved(covariance);
  const Eigen::MatrixXd root = solved.eigenvectors() * solved.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  std::vector<double> variance(values.size(), 0);
  for (Eigen::Index k = 0; k < root.cols(); ++k) {
    const std::vector<double> moved = values_of(scale(coefficients + root.col(k)));
    for (std::size_t i = 0; i < values.size(); ++i) variance[i] += std::pow(std::log(moved[i] / values[i]), 2);
  }
  JsonList low, high, axes;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double factor = std::exp(stats::kNormal95 * std::sqrt(variance[i]));
    *low.add_values() = json_value(values[i] / factor);
    *high.add_values() = json_value(values[i] * factor);
  }
  *axes.add_values() = axis_of(fitted.of());
  if (fitted.has_spline_2d()) *axes.add_values() = axis_of(fitted.and_of());
  JsonValue out;
  auto& band = *out.mutable_struct_value()->mutable_fields();
  band["axes"] = json_value(std::move(axes));
  band["at"] = json_value(places_of(fitted));
  band["value"] = json_value(json_list(values));
  band["low"] = json_value(std::move(low));
  band["high"] = json_value(std::move(high));
  return out;
}

}  // namespace kilotwin::identify

#include "core/effects/function.hpp"

#include <algorithm>

#include "core/base/pose.hpp"
#include "core/effects/motion_change.hpp"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

/// Exponents are limited to this value, so that results stay finite for any model.
constexpr double kLargestExponent = 60;

/// Sample points for largest(): the ends of the range, the knots within it, and points between the knots.
std::vector<double> sample_points(Range range, std::span<const double> knots) {
  std::vector<double> all{range.min, range.max};
  for (std::size_t i = 0; i < knots.size(); ++i) {
    all.push_back(knots[i]);
    if (i == 0) continue;
    for (int q = 1; q < 4; ++q) all.push_back(knots[i - 1] + 0.25 * q * (knots[i] - knots[i - 1]));
  }
  for (double& c : all) c = std::clamp(c, range.min, range.max);
  return all;
}

}  // namespace

double EffectFunction::Exponential::operator()(double c, double) const {
  return at_infinity + difference * kt_exp(std::min(rate * c, kLargestExponent));
}

double EffectFunction::Harmonic::operator()(double c, double) const {
  double s, k;
  kt_sincos(turns_rad * c, &s, &k);
  return mean + cosine * k + sine * s;
}

double EffectFunction::Steps::operator()(double c, double) const {
  return value[static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), c) - at.begin())];
}

EffectFunction::EffectFunction(const FunctionSettings& function) : shape_(compiled(function)) {}

EffectFunction::Shape EffectFunction::compiled(const FunctionSettings& function) {
  struct Compile {
    Shape operator()(const ConstantShape& f) const { return Constant{f.value}; }
    Shape operator()(const LinearShape& f) const { return Linear{f.at_zero, f.slope}; }
    Shape operator()(const ExponentialShape& f) const {
      return Exponential{f.at_infinity, f.at_zero - f.at_infinity, -1 / f.scale};
    }
    Shape operator()(const HarmonicShape& f) const {
      return Harmonic{f.mean, f.cosine, f.sine, 2 * kPi / f.period};
    }
    Shape operator()(const SplineShape& f) const { return One{Spline(f.knots, f.values)}; }
    Shape operator()(const Spline2dShape& f) const { return Spline2d(f.first_knots, f.second_knots, f.values); }
    Shape operator()(const StepsShape& f) const { return Steps{f.at, f.values}; }
    Shape operator()(const TableShape& f) const {
      Table table{{}, f.otherwise};
      for (const std::uint32_t key : f.keys) {
        if (table.value.size() <= key) table.value.resize(std::size_t{key} + 1, table.otherwise);
      }
      for (std::size_t i = 0; i < f.keys.size(); ++i) table.value[f.keys[i]] = f.values[i];
      return table;
    }
    Shape operator()(const NoiseShape& f) const { return Constant{f.sd}; }
    Shape operator()(const EpisodesShape&) const { return Constant{1}; }
  };
  return std::visit(Compile{}, function.shape);
}

void EffectFunction::multiply(std::span<const double> first, std::span<const double> second,
                              std::span<double> value) const {
  std::visit(
      [&](const auto& f) {
        using F = std::decay_t<decltype(f)>;
        if constexpr (std::is_same_v<F, Constant>) {
          for (double& v : value) v *= f.value;
        } else if constexpr (std::is_same_v<F, Spline2d>) {
          for (std::size_t i = 0; i < value.size(); ++i) value[i] *= f(first[i], second[i]);
        } else {
          for (std::size_t i = 0; i < value.size(); ++i) value[i] *= f(first[i], 0);
        }
      },
      shape_);
}

double EffectFunction::operator()(double first, double second) const {
  return std::visit([&](const auto& f) { return f(first, second); }, shape_);
}

double EffectFunction::largest(Range first, Range second) const {
  double largest = 0;
  const auto look = [&](double c, double d) { largest = std::max(largest, magnitude((*this)(c, d))); };
  if (const auto* const harmonic = std::get_if<Harmonic>(&shape_)) {
    return magnitude(harmonic->mean) +
           __builtin_sqrt(harmonic->cosine * harmonic->cosine + harmonic->sine * harmonic->sine);
  }
  if (const auto* const steps = std::get_if<Steps>(&shape_)) {
    for (const double v : steps->value) largest = std::max(largest, magnitude(v));
    return largest;
  }
  if (const auto* const table = std::get_if<Table>(&shape_)) {
    largest = magnitude(table->otherwise);
    for (const double v : table->value) largest = std::max(largest, magnitude(v));
    return largest;
  }
  if (const auto* const two = std::get_if<Spline2d>(&shape_)) {
    for (const double d : sample_points(second, two->second_knots())) {
      for (const double c : sample_points(first, two->first_knots())) look(c, d);
    }
    return largest;
  }
  std::span<const double> knots;
  if (const auto* const one = std::get_if<One>(&shape_)) knots = one->spline.knots();
  for (const double c : sample_points(first, knots)) look(c, 0);
  return largest;
}

}  // namespace kilotwin

#include "core/effects/function.hpp"

#include <algorithm>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

/// exp() of more is taken as that: values stay finite, whatever a model says.
constexpr double kLargestExponent = 60;

std::vector<double> values(const google::protobuf::RepeatedField<double>& field) {
  return {field.begin(), field.end()};
}

double magnitude(double v) { return v < 0 ? -v : v; }

/// The ends of the range, and the knots within it with places between them.
std::vector<double> trials(Range range, std::span<const double> knots) {
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

EffectFunction::EffectFunction(const proto::Function& function) : shape_(shape_of(function)) {}

EffectFunction::Shape EffectFunction::shape_of(const proto::Function& f) {
  switch (f.shape_case()) {
    case proto::Function::kConstant: return Constant{f.constant()};
    case proto::Function::kNoise: return Constant{f.noise().sd()};
    case proto::Function::kEpisodes: return Constant{1};
    case proto::Function::kLinear: return Linear{f.linear().at_zero(), f.linear().slope()};
    case proto::Function::kExponential: {
      const proto::Exponential& e = f.exponential();
      return Exponential{e.at_infinity(), e.at_zero() - e.at_infinity(), -1 / e.scale()};
    }
    case proto::Function::kHarmonic: {
      const proto::Harmonic& h = f.harmonic();
      return Harmonic{h.mean(), h.cosine(), h.sine(), 2 * kPi / h.period()};
    }
    case proto::Function::kSpline: return One{Spline(values(f.spline().knot()), values(f.spline().value()))};
    case proto::Function::kSpline2D: {
      const proto::Spline2d& s = f.spline_2d();
      return Spline2d(values(s.knot()), values(s.and_knot()), values(s.value()));
    }
    case proto::Function::kSteps: return Steps{values(f.steps().at()), values(f.steps().value())};
    case proto::Function::kTable: {
      Table table{{}, f.table().otherwise()};
      for (const std::uint32_t key : f.table().key()) {
        if (table.value.size() <= key) table.value.resize(std::size_t{key} + 1, table.otherwise);
      }
      for (int i = 0; i < f.table().key_size(); ++i) table.value[f.table().key(i)] = f.table().value(i);
      return table;
    }
    case proto::Function::SHAPE_NOT_SET: break;
  }
  return Constant{0};
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
    for (const double d : trials(second, two->second_knots())) {
      for (const double c : trials(first, two->first_knots())) look(c, d);
    }
    return largest;
  }
  std::span<const double> knots;
  if (const auto* const one = std::get_if<One>(&shape_)) knots = one->spline.knots();
  for (const double c : trials(first, knots)) look(c, 0);
  return largest;
}

}  // namespace kilotwin

/// The compiled function of an effect: computes values from covariates.
#pragma once

#include <cstdint>
#include <span>
#include <variant>

#include "core/effects/spline.hpp"
#include "core/plan/effect_settings.hpp"

namespace kilotwin {

/// Range of a covariate.
struct Range {
  double min, max;
};

class EffectFunction {
 public:
  /// Compiles a validated function. Noise becomes the constant sd.
  explicit EffectFunction(const FunctionSettings&);

  /// value[i] *= f(first[i]), or f(first[i], second[i]). Finite for finite covariates.
  void multiply(std::span<const double> first, std::span<const double> second, std::span<double> value) const;
  [[nodiscard]] double operator()(double first, double second = 0) const;
  /// Approximate maximum of |f| over the ranges; it may be a few per cent too small.
  [[nodiscard]] double largest(Range first, Range second) const;

 private:
  struct Constant {
    double value;
    double operator()(double, double) const { return value; }
  };
  struct Linear {
    double at_zero, slope;
    double operator()(double c, double) const { return at_zero + slope * c; }
  };
  struct Exponential {
    double at_infinity, difference, rate;
    double operator()(double c, double) const;
  };
  struct Harmonic {
    double mean, cosine, sine, turns_rad;
    double operator()(double c, double) const;
  };
  struct One {
    Spline spline;
    double operator()(double c, double) const { return spline(c); }
  };
  struct Steps {
    std::vector<double> at, value;
    double operator()(double c, double) const;
  };
  struct Table {
    std::vector<double> value;
    double otherwise;
    double operator()(double c, double) const {
      return c >= 0 && c < static_cast<double>(value.size()) ? value[static_cast<std::size_t>(c)] : otherwise;
    }
  };
  using Shape = std::variant<Constant, Linear, Exponential, Harmonic, One, Spline2d, Steps, Table>;

  static Shape compiled(const FunctionSettings&);

  Shape shape_;
};

}  // namespace kilotwin

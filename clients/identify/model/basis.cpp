#include "clients/identify/model/basis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

double unit_of(double c, double low, double high, double warp) {
  const double inside = std::clamp(c, low, high) - low;
  if (warp > 0) return std::log1p(inside / warp) / std::log1p((high - low) / warp);
  return inside / (high - low);
}

/// cos(k a), k = 0..last, by Chebyshev's recurrence with stride four, so that four chains run in parallel.
void cosines(double angle, std::uint32_t last, double* to) {
  const double c = std::cos(angle), c2 = 2 * c * c - 1, c4 = 2 * c2 * c2 - 1;
  const double start[] = {1, c, c2, c * (2 * c2 - 1), c4};
  for (std::uint32_t k = 0; k <= std::min(last, 4u); ++k) to[k] = start[k];
  for (std::uint32_t k = 5; k <= last; ++k) to[k] = 2 * c4 * to[k - 4] - (k < 8 ? to[8 - k] : to[k - 8]);
}

/// cos(k a), sin(k a), k = first..first + count - 1, by rotations: one sine and one cosine in place of `count`.
void harmonics(double angle, std::uint32_t first, std::uint32_t count, double* to) {
  const std::complex<double> step = std::polar(1.0, angle);
  std::complex<double> now = first == 1 ? step : std::polar(1.0, first * angle);
  for (std::uint32_t k = 0; k < count; ++k) {
    to[2 * k] = now.real();
    to[2 * k + 1] = now.imag();
    now = {now.real() * step.real() - now.imag() * step.imag(),
           now.real() * step.imag() + now.imag() * step.real()};
  }
}

/// Legendre polynomials P_k(at), k = 0..last.
void legendre(double at, std::uint32_t last, double* to) {
  to[0] = 1;
  to[1] = at;
  for (std::uint32_t k = 1; k < last; ++k) to[k + 1] = ((2 * k + 1) * at * to[k] - k * to[k - 1]) / (k + 1);
}

}  // namespace

std::size_t Factor::columns() const {
  switch (shape) {
    case Shape::kLinear:
    case Shape::kGrid: return 1;
    case Shape::kCosines:
    case Shape::kTaper: return count;
    case Shape::kCosines2: return (count + 1) * (count + 2) / 2 - first;
    case Shape::kPolynomials2: return (count + 1) * (count + 2) / 2 - 1;
    case Shape::kHarmonics:
    case Shape::kTravelling: return 2 * std::size_t{count};
    case Shape::kTable:
    case Shape::kAtLeast:
    case Shape::kExponential:
    case Shape::kLevelling: return points.size();
    case Shape::kWave: return 2 * points.size();
    case Shape::kPointShift: return axis.of == Covariate::kAlong ? 1 : 5;
  }
  return 0;
}

void Factor::evaluate(const Situation& s, std::size_t wheel, double* to) const {
  if (known.empty()) return evaluate_columns(s, wheel, to);
  std::array<double, kMostColumns> values;
  evaluate_columns(s, wheel, values.data());
  collapse(values.data(), to);
}

void Factor::evaluate_at(double value, double and_value, double* to) const {
  if (known.empty()) return columns_at(value, and_value, 0, to);
  std::array<double, kMostColumns> values;
  columns_at(value, and_value, 0, values.data());
  collapse(values.data(), to);
}

void Factor::collapse(const double* values, double* to) const {
  double sum = plus;
  for (std::size_t i = 0; i < known.size(); ++i) sum += known[i] * values[i];
  to[0] = sum;
}

void Factor::evaluate_columns(const Situation& s, std::size_t wheel, double* to) const {
  switch (shape) {
    case Shape::kPointShift: return shifted(value_of(axis, s, wheel), s, to);
    case Shape::kTravelling:
      return columns_at(points[0] * s.x_mm + points[1] * s.y_mm - points[2] * s.time_s, 0, s.span_s, to);
    default: return columns_at(value_of(axis, s, wheel), of_two() ? value_of(and_axis, s, wheel) : 0, s.span_s, to);
  }
}

void Factor::columns_at(double c, double d, double span_s, double* to) const {
  std::array<double, kMostColumns + 1> a, b;
  switch (shape) {
    case Shape::kLinear: to[0] = (std::clamp(c, low, high) - low) / (high - low); return;
    case Shape::kCosines:
      cosines(M_PI * unit_of(c, low, high, warp), first + count - 1, a.data());
      for (std::uint32_t k = 0; k < count; ++k) to[k] = a[first + k];
      return;
    case Shape::kCosines2:
      cosines(M_PI * unit_of(c, low, high, warp), count, a.data());
      cosines(M_PI * unit_of(d, and_low, and_high, 0), count, b.data());
      for (std::uint32_t sum = first; sum <= count; ++sum)
        for (std::uint32_t k = 0; k <= sum; ++k) *to++ = a[sum - k] * b[k];
      return;
    case Shape::kPolynomials2:
      legendre(2 * unit_of(c, low, high, warp) - 1, count, a.data());
      legendre(2 * unit_of(d, and_low, and_high, 0) - 1, count, b.data());
      for (std::uint32_t sum = 1; sum <= count; ++sum)
        for (std::uint32_t k = 0; k <= sum; ++k) *to++ = a[sum - k] * b[k];
      return;
    case Shape::kHarmonics:
    case Shape::kTravelling: harmonics(c, first, count, to); return;
    case Shape::kTable:
      for (std::size_t i = 0; i < points.size(); ++i) to[i] = c == points[i] ? 1 : 0;
      return;
    case Shape::kAtLeast:
      // Within a sub-step: the fraction of the sub-step after the point.
      for (std::size_t i = 0; i < points.size(); ++i) {
        to[i] = axis.of == Covariate::kTime && span_s > 0 ? std::clamp((c - points[i]) / span_s + 0.5, 0.0, 1.0)
                                                          : (c >= points[i] ? 1 : 0);
      }
      return;
    case Shape::kLevelling:
      // Most often there is none, or it has just begun.
      for (std::size_t i = 0; i < points.size(); ++i) to[i] = c == 0 ? 0 : -std::expm1(-c / points[i]);
      return;
    case Shape::kExponential:
      for (std::size_t i = 0; i < points.size(); ++i) to[i] = std::exp(-c / points[i]);
      return;
    case Shape::kTaper: {
      const double rest = std::max(0.0, 1 - c / high);
      double power = 1;
      for (std::uint32_t k = 0; k < count; ++k) to[k] = power *= rest;
      return;
    }
    case Shape::kGrid: {
      const std::size_t columns = count, rows = points.size() / columns;
      const double u = unit_of(c, low, high, 0) * static_cast<double>(columns - 1);
      const double v = unit_of(d, and_low, and_high, 0) * static_cast<double>(rows - 1);
      const std::size_t i = std::min(static_cast<std::size_t>(u), columns - 2),
                        j = std::min(static_cast<std::size_t>(v), rows - 2);
      const double x = u - static_cast<double>(i), y = v - static_cast<double>(j);
      const double* const at = points.data() + j * columns + i;
      to[0] = (1 - y) * ((1 - x) * at[0] + x * at[1]) + y * ((1 - x) * at[columns] + x * at[columns + 1]);
      return;
    }
    case Shape::kPointShift: return;
    case Shape::kWave:
      for (std::size_t i = 0; i < points.size(); ++i) {
        to[2 * i] = std::cos(2 * M_PI * c / points[i]);
        to[2 * i + 1] = std::sin(2 * M_PI * c / points[i]);
      }
      return;
  }
}

void Factor::shifted(double c, const Situation& s, double* to) const {
  const double u = (c - low) / (high - low);
  double slope = 0;  // per mm; 0 beyond the range, where the curve is constant
  if (u > 0 && u < 1) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double wave = M_PI * (first + static_cast<double>(k));
      slope -= points[k] * wave * std::sin(wave * u) / (high - low);
    }
  }
  if (axis.of == Covariate::kAlong) {
    const double across_mm = s.y_mm * std::cos(axis.along_rad) - s.x_mm * std::sin(axis.along_rad);
    to[0] = slope * across_mm * kDirectionUnit_rad;
    return;
  }
  const double dx = s.x_mm - axis.point.x_mm_at(s.time_s), dy = s.y_mm - axis.point.y_mm_at(s.time_s),
               distance = std::max(std::hypot(dx, dy), 1e-6), time = s.time_s / count;
  to[0] = -slope * dx / distance;
  to[1] = -slope * dy / distance;
  to[2] = to[0] * time;
  to[3] = to[1] * time;
  to[4] = -slope * time;
}

std::vector<double> Factor::roughness() const {
  std::vector<double> rough(size(), 1.0);
  if (!known.empty()) return rough;
  if (shape == Shape::kCosines) {
    for (std::uint32_t k = 0; k < count; ++k) rough[k] = std::max(first + k, 1u);
  } else if (shape == Shape::kTaper) {
    // An effect at close range has high powers, too.
    for (std::uint32_t k = 0; k < count; ++k) rough[k] = std::sqrt(1.0 + k);
  } else if (shape == Shape::kHarmonics || shape == Shape::kTravelling) {
    for (std::uint32_t k = 0; k < count; ++k) rough[2 * k] = rough[2 * k + 1] = first + k;
  } else if (shape == Shape::kPolynomials2) {
    std::size_t i = 0;
    for (std::uint32_t sum = 1; sum <= count; ++sum)
      for (std::uint32_t k = 0; k <= sum; ++k) rough[i++] = sum;
  } else if (shape == Shape::kCosines2) {
    std::size_t i = 0;
    for (std::uint32_t sum = first; sum <= count; ++sum)
      for (std::uint32_t k = 0; k <= sum; ++k)
        rough[i++] = std::max(1.0, std::sqrt((sum - k) * (sum - k) + k * k + 0.0));
  }
  return rough;
}

std::size_t Basis::size() const {
  if (!chosen.empty()) return chosen.size();
  std::size_t size = 1;
  for (const Factor& factor : factors) size *= factor.size();
  return size;
}

bool Basis::lacks_key(const Situation& s) const {
  return std::any_of(factors.begin(), factors.end(), [&](const Factor& f) {
    return f.shape == Factor::Shape::kTable && f.known.empty() &&
           std::find(f.points.begin(), f.points.end(), value_of(f.axis, s, 0)) == f.points.end();
  });
}

void Basis::evaluate(const Situation& s, std::size_t wheel, double* to) const {
  to[0] = 1;
  std::size_t have = 1;
  std::array<double, kMostColumns> of_factor;
  if (!factors.empty()) {
    have = factors.front().size();
    KILOTWIN_DEMAND(have <= kMostColumns);
    factors.front().evaluate(s, wheel, to);
  }
  for (std::size_t f = 1; f < factors.size(); ++f) {
    const Factor& factor = factors[f];
    const std::size_t n = factor.size();
    KILOTWIN_DEMAND(have * n <= kMostColumns);
    factor.evaluate(s, wheel, of_factor.data());
    // From the last column on, so that no column is overwritten before it is read.
    for (std::size_t i = have; i-- > 0;) {
      const double by = to[i];
      if (by == 0) {
        // Nearly all columns of a table.
        std::fill_n(to + i * n, n, 0.0);
      } else {
        for (std::size_t j = n; j-- > 0;) to[i * n + j] = by * of_factor[j];
      }
    }
    have *= n;
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) to[i] = to[chosen[i]];
}

std::vector<double> Basis::roughness() const {
  std::vector<double> rough{1.0};
  for (const Factor& factor : factors) {
    std::vector<double> next;
    for (const double r : rough)
      for (const double own : factor.roughness()) next.push_back(r * own);
    rough = std::move(next);
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) rough[i] = rough[chosen[i]];
  if (!chosen.empty()) rough.resize(chosen.size());
  return rough;
}

const Factor* Basis::only_open() const {
  const Factor* open = nullptr;
  for (const Factor& factor : factors) {
    if (!factor.known.empty()) continue;
    if (open != nullptr) return nullptr;
    open = &factor;
  }
  return open;
}

Factor* Basis::only_open() { return const_cast<Factor*>(std::as_const(*this).only_open()); }

bool Basis::looks_at(Covariate covariate) const {
  return std::any_of(factors.begin(), factors.end(), [&](const Factor& f) {
    const bool travels = f.shape == Factor::Shape::kTravelling;
    return f.axis.of == covariate || ((f.of_two() || travels) && f.and_axis.of == covariate) ||
           (travels && covariate == Covariate::kTime);
  });
}

}  // namespace kilotwin::identify

/// Bases of functions of covariates. An effect is a linear combination of the columns of a basis.
#pragma once

#include <vector>

#include "clients/identify/model/covariates.hpp"

namespace kilotwin::identify {

/// Columns over one covariate or two.
struct Factor {
  enum class Shape : std::uint8_t {
    kLinear,        ///< (c - low) / (high - low)
    kCosines,       ///< cos(k pi u), k = first..; u = (c - low) / (high - low)
    kCosines2,      ///< cos(j pi u) cos(k pi v), first <= j + k <= order, over two covariates; first: 0 or 1
    kPolynomials2,  ///< P_j(2u - 1) P_k(2v - 1), 0 < j + k <= order, Legendre polynomials, over two covariates
    kHarmonics,     ///< cos(k a), sin(k a), k = first..; a: an angle
    kTable,         ///< indicator of a key, one column per point
    kAtLeast,       ///< indicator of c >= point, one column per point
    kExponential,   ///< exp(-c / point), one column per point
    kLevelling,     ///< 1 - exp(-c / point), one column per point
    kTaper,         ///< (1 - c / high)^k, k = 1..; 0 from `high` on
    kGrid,          ///< one column: bilinear interpolation of `points` on a grid, over two covariates
    kWave,          ///< cos and sin of 2 pi c / point, two columns per point
    /// cos(k p), sin(k p), k = first.., with the phase p = points[0] x + points[1] y - points[2] t, in rad, mm and s
    kTravelling,
    /// Derivatives of the curve sum of points[k] cos((first + k) pi u). Over kPointDistance by the numbers of its point: x, y,
    /// velocity_x, velocity_y, growth; five columns, the last three over a unit of `count` s. Over kAlong by its direction; one column,
    /// over kDirectionUnit_rad
    kPointShift,
  };
  /// Unit of a direction: 1 mm at a distance of 1 m, so that steps of directions and of places are alike.
  static constexpr double kDirectionUnit_rad = 1e-3;
  Shape shape = Shape::kLinear;
  Axis axis, and_axis;
  double low = 0, high = 1, and_low = 0, and_high = 1;
  /// kCosines, kHarmonics, kTravelling, kTaper: the first k and the number of columns. kCosines2, kPolynomials2: count is the
  /// order. kGrid: count is the number of nodes along the first axis.
  std::uint32_t first = 1, count = 1;
  /// Above 0: logarithmic scale u = log(1 + (c - low) / warp), normalised. It resolves values near `low` finely.
  double warp = 0;
  std::vector<double> points;
  /// Not empty: fixed coefficients. The columns collapse into one, a known curve.
  std::vector<double> known = {};
  /// Constant added to a known curve: tables, steps, cosines, maps, harmonics.
  double plus = 0;

  [[nodiscard]] bool of_two() const {
    return shape == Shape::kCosines2 || shape == Shape::kPolynomials2 || shape == Shape::kGrid;
  }
  [[nodiscard]] std::size_t size() const { return known.empty() ? columns() : 1; }
  [[nodiscard]] std::size_t columns() const;  ///< number of columns before a known curve collapses them
  void evaluate(const Situation&, std::size_t wheel, double* to) const;
  /// The same at values of the covariates, whatever they depend on. kTravelling: `value` is the phase. Not for kPointShift.
  void evaluate_at(double value, double and_value, double* to) const;
  /// Roughness of each column, 1 for the smoothest. The prior variance falls with the roughness.
  [[nodiscard]] std::vector<double> roughness() const;
  bool operator==(const Factor&) const = default;

 private:
  void evaluate_columns(const Situation&, std::size_t wheel, double* to) const;
  /// `span_s`: as of Situation.
  void columns_at(double value, double and_value, double span_s, double* to) const;
  void collapse(const double* values, double* to) const;
  /// kPointShift. `c`: the distance.
  void shifted(double c, const Situation&, double* to) const;
};

/// The products of the columns of all factors. Without factors: one column of ones.
struct Basis {
  std::vector<Factor> factors;
  /// Not empty: the indices of the products in use, ascending.
  std::vector<std::uint32_t> chosen = {};

  [[nodiscard]] std::size_t size() const;
  /// Whether all columns are 0 because a table lacks the present key: the cheap test before evaluate().
  [[nodiscard]] bool lacks_key(const Situation&) const;
  /// `to` has room for all products.
  void evaluate(const Situation&, std::size_t wheel, double* to) const;
  [[nodiscard]] std::vector<double> roughness() const;
  [[nodiscard]] bool looks_at(Covariate) const;
  /// The one factor without known coefficients; null if there are several.
  [[nodiscard]] const Factor* only_open() const;
  [[nodiscard]] Factor* only_open();
  /// Whether the left and the right wheel have different values.
  [[nodiscard]] bool per_wheel() const { return looks_at(Covariate::kMotorTime); }
  bool operator==(const Basis&) const = default;
};

inline constexpr std::size_t kMostColumns = 160;  ///< upper bound of the columns of one basis

}  // namespace kilotwin::identify

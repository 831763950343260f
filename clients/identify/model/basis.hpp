/// Functions of covariates in which effects are sought and written: each a sum of coefficients times the columns of a basis.
#pragma once

#include <vector>

#include "clients/identify/model/covariates.hpp"

namespace kilotwin::identify {

/// Columns over one covariate (or two).
struct Factor {
  enum class Shape : std::uint8_t {
    kLinear,        ///< (c - low) / (high - low)
    kCosines,       ///< cos(k pi u), k = first.. , u in 0..1 over low..high
    kCosines2,      ///< cos(j pi u) cos(k pi v), 0 < j + k <= order, over two covariates
    kPolynomials2,  ///< P_j(2u - 1) P_k(2v - 1), 0 < j + k <= order, Legendre's, over two covariates
    kHarmonics,     ///< cos(k a), sin(k a), k = first..: of an angle
    kTable,         ///< 1 where the covariate is the key, one column per point
    kAtLeast,       ///< 1 from the point on, one column per point
    kExponential,   ///< exp(-c / point), one column per point
    kLevelling,     ///< 1 - exp(-c / point), one column per point
    kTaper,         ///< (1 - c / high)^k, k = 1..: 0 from high on
    kGrid,          ///< one column: linear between `points` at the nodes of a grid, over two covariates
    kWave,          ///< cos and sin of 2 pi c / point: two columns per point
  };
  Shape shape = Shape::kLinear;
  Axis axis, and_axis;
  double low = 0, high = 1, and_low = 0, and_high = 1;
  /// Of kCosines, kHarmonics, kTaper; kCosines2, kPolynomials2: count is the order; kGrid: nodes along the first.
  std::uint32_t first = 1, count = 1;
  /// Above 0: u runs as log(1 + (c - low) / warp), so that what is near `low` is resolved finely.
  double warp = 0;
  std::vector<double> points;
  /// Not empty: the columns are added up by these coefficients into one, a curve that is known.
  std::vector<double> known = {};
  /// Of a curve that is known: added to it. Amounts alone have it: tables, cosines, maps, harmonics.
  double plus = 0;

  [[nodiscard]] bool of_two() const {
    return shape == Shape::kCosines2 || shape == Shape::kPolynomials2 || shape == Shape::kGrid;
  }
  [[nodiscard]] std::size_t size() const { return known.empty() ? columns() : 1; }
  [[nodiscard]] std::size_t columns() const;  ///< before they are added up
  void evaluate(const Situation&, std::size_t wheel, double* to) const;
  /// How wiggly each column is; 1 for the smoothest. Larger roughness is less probable beforehand.
  [[nodiscard]] std::vector<double> roughness() const;

 private:
  void evaluate_columns(const Situation&, std::size_t wheel, double* to) const;
};

/// The products of columns of all factors; one column of ones where there are none.
struct Basis {
  std::vector<Factor> factors;
  /// Not empty: these columns of the products alone, ascending.
  std::vector<std::uint32_t> chosen = {};

  [[nodiscard]] std::size_t size() const;
  /// `to` has room for all products.
  void evaluate(const Situation&, std::size_t wheel, double* to) const;
  [[nodiscard]] std::vector<double> roughness() const;
  [[nodiscard]] bool looks_at(Covariate) const;
  /// Its factor, where all others are curves that are known.
  [[nodiscard]] const Factor* only_open() const;
  [[nodiscard]] Factor* only_open();
  /// Whether left and right wheels have values of their own.
  [[nodiscard]] bool per_wheel() const { return looks_at(Covariate::kMotorTime); }
};

inline constexpr std::size_t kMostColumns = 160;  ///< of one basis

}  // namespace kilotwin::identify

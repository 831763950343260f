#include "clients/identify/search/product_functions.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/products.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Nodes along each axis of a smooth map as known values: five per half-wave of its finest column.
constexpr std::uint32_t kNodes = 97;

/// A block's open factor with its share of the coefficients; null: a constant.
struct Summand {
  const Factor* open;
  Basis basis;
  Eigen::VectorXd coefficients;

  [[nodiscard]] double at(const Situation& s) const {
    std::array<double, kMostColumns> values;
    basis.evaluate(s, 0, values.data());
    return coefficients.dot(Eigen::Map<const Eigen::VectorXd>(values.data(), coefficients.size()));
  }
  /// At a value of its only covariate.
  [[nodiscard]] double of(double value, std::array<double, kMostColumns>& columns) const {
    if (open == nullptr) return coefficients[0];
    open->evaluate_at(value, 0, columns.data());
    double sum = 0;
    for (std::size_t i = 0; i < basis.size(); ++i)
      sum += coefficients[static_cast<Eigen::Index>(i)] * columns[basis.chosen.empty() ? i : basis.chosen[i]];
    return sum;
  }
};

/// The parts of a term that act on its first target, without the known factors that they share; empty: they do not share them.
std::vector<Summand> summands_of(const Term& term) {
  std::vector<Summand> all;
  const Block& first = term.blocks.front();
  const auto count_known = [](const Basis& basis) {
    return std::count_if(basis.factors.begin(), basis.factors.end(),
                         [](const Factor& f) { return !f.known.empty(); });
  };
  Eigen::Index next = 0;
  for (const Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    const Eigen::Index from = std::exchange(next, next + n);
    if (block.target != first.target || block.during != first.during) continue;
    const auto known = count_known(block.basis),
               open = static_cast<std::ptrdiff_t>(block.basis.factors.size()) - known;
    if (known != count_known(first.basis) || open > 1) return {};
    Summand one{block.basis.only_open(), {}, term.coefficients.segment(from, n)};
    if (one.open != nullptr) one.basis = {{*one.open}, block.basis.chosen};
    all.push_back(std::move(one));
  }
  return all;
}

/// A sum of curves over one covariate, as a smooth one and its sudden changes, as cosines. Nothing if they do not share it, or if none
/// is of cosines.
std::optional<Factor> projected(const std::vector<Summand>& summands, Target target) {
  constexpr std::uint32_t kCosines = 64;  // as many as a curve over time has
  constexpr int kSamples = 8 * kCosines;  // midpoints, at which different cosines are orthogonal
  const Factor* curve = nullptr;
  for (const Summand& one : summands)
    if (one.open != nullptr && one.open->shape == Shape::kCosines) curve = one.open;
  if (curve == nullptr) return std::nullopt;
  for (const Summand& one : summands)
    if (one.open != nullptr && (one.open->of_two() || !(one.open->axis == curve->axis))) return std::nullopt;
  Factor sum = *curve;
  sum.first = 1;
  sum.count = kCosines;
  sum.warp = 0;
  sum.known.assign(kCosines, 0);
  std::array<double, kMostColumns> columns;
  for (int i = 0; i < kSamples; ++i) {
    const double u = (i + 0.5) / kSamples, at = sum.low + u * (sum.high - sum.low);
    double total = 0, gain = 1;
    for (const Summand& one : summands) {
      const double own = one.of(at, columns);
      total += own;
      gain *= 1 + own;
    }
    const double value = (is_gain(target) ? gain - 1 : total) / kSamples;
    sum.plus += value;
    for (std::uint32_t k = 1; k <= kCosines; ++k) sum.known[k - 1] += 2 * value * std::cos(M_PI * k * u);
  }
  return sum;
}

/// Values of a map at nodes; nothing if the summands do not share a plane.
std::optional<Factor> sampled(const std::vector<Summand>& summands, Target target) {
  Factor grid;
  grid.shape = Shape::kGrid;
  grid.axis.of = Covariate::kX;
  grid.and_axis.of = Covariate::kY;
  std::uint32_t rows = kNodes;
  grid.count = kNodes;
  const auto reach = [&](Covariate of, double low, double high) {
    (of == Covariate::kX ? grid.low : grid.and_low) = low;
    (of == Covariate::kX ? grid.high : grid.and_high) = high;
  };
  bool of_x = false, of_y = false;
  for (const Summand& one : summands) {
    if (one.open == nullptr) continue;
    const Factor& f = *one.open;
    if (!is_of_place(f) || (f.of_two() && f.and_axis.of != Covariate::kY)) return std::nullopt;
    reach(f.axis.of, f.low, f.high);
    if (f.of_two()) reach(f.and_axis.of, f.and_low, f.and_high);
    of_x = of_x || f.axis.of == Covariate::kX;
    of_y = of_y || f.axis.of == Covariate::kY || f.of_two();
    if (f.shape != Shape::kGrid) continue;
    grid.count = f.count;
    rows = static_cast<std::uint32_t>(f.points.size()) / f.count;
  }
  if (!of_x || !of_y) return std::nullopt;
  Situation s;
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < grid.count; ++i) {
      s.x_mm = grid.low + (grid.high - grid.low) * i / (grid.count - 1);
      s.y_mm = grid.and_low + (grid.and_high - grid.and_low) * j / (rows - 1);
      double sum = 0, gain = 1;
      for (const Summand& one : summands) {
        const double own = one.at(s);
        sum += own;
        gain *= 1 + own;
      }
      // Gains of blocks multiply, all else adds up.
      grid.points.push_back(is_gain(target) ? gain - 1 : sum);
    }
  }
  grid.known = {1};
  return grid;
}

}  // namespace

std::optional<Factor> function_of(const Term& term) {
  const std::vector<Summand> summands = summands_of(term);
  const Summand* open = nullptr;
  std::size_t count = 0;
  double constant = 0;
  for (const Summand& one : summands) {
    if (one.open == nullptr) {
      constant += one.coefficients[0];
    } else {
      open = &one;
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  const Target target = term.blocks.front().target;
  if (count > 1 && !is_of_place(*open->open)) return projected(summands, target);
  if (count > 1 || open->open->of_two()) return sampled(summands, target);
  Factor function = *open->open;
  function.known.assign(function.columns(), 0);
  for (std::size_t i = 0; i < open->basis.size(); ++i)
    function.known[open->basis.chosen.empty() ? i : open->basis.chosen[i]] =
        open->coefficients[static_cast<Eigen::Index>(i)];
  function.plus = constant;
  // Columns that are constant.
  if (function.shape == Shape::kHarmonics && function.first == 0 && function.count > 1) {
    function.plus += function.known[0];
    function.known.erase(function.known.begin(), function.known.begin() + 2);
    ++function.first;
    --function.count;
  }
  if (function.shape == Shape::kAtLeast && function.points.size() > 1 && function.points.front() < 0) {
    function.plus += function.known[0];
    function.known.erase(function.known.begin());
    function.points.erase(function.points.begin());
  }
  return function;
}

std::optional<FactorPair> pair_of(const Term& term) {
  FactorPair pair;
  Eigen::Index rows = 0;
  for (const Block& block : term.blocks) {
    const std::vector<Factor>& f = block.basis.factors;
    if (f.size() != 2 || !f[0].known.empty() || !f[1].known.empty() || block.target != term.blocks.front().target ||
        block.during != term.blocks.front().during)
      return std::nullopt;
    if (rows == 0) {
      pair.one = f[0];
      pair.other = f[1];
    } else {
      const bool continues = pair.one.shape == Shape::kCosines && f[0].shape == Shape::kCosines &&
                             pair.one.axis == f[0].axis && f[0].first == pair.one.first + pair.one.count &&
                             f[1].shape == pair.other.shape && f[1].count == pair.other.count;
      if (!continues) return std::nullopt;
      pair.one.count += f[0].count;
    }
    const auto across = static_cast<Eigen::Index>(f[1].size());
    for (std::size_t i = 0; i < block.basis.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(block.basis.chosen.empty() ? i : block.basis.chosen[i]);
      pair.at.emplace_back(rows + column / across, column % across);
    }
    rows += static_cast<Eigen::Index>(f[0].size());
  }
  if (pair.one.size() < 2 || pair.other.size() < 2) return std::nullopt;
  return pair;
}

namespace {

/// A step in time times a table, both open (simplify_to_switch), as known factors.
std::vector<Factor> functions_of_switch(const Term& term) {
  const Basis& basis = term.blocks.front().basis;
  if (term.blocks.size() != 1 || basis.factors.size() < 2) return {};
  const std::size_t at = basis.factors.size() - 2;
  const Factor &step = basis.factors[at], &table = basis.factors[at + 1];
  if (step.shape != Shape::kAtLeast || step.points.size() != 1 || table.shape != Shape::kTable ||
      !step.known.empty() || !table.known.empty())
    return {};
  std::vector<Factor> functions = basis.factors;
  functions[at].known = {1};
  functions[at + 1].known.assign(table.columns(), 0);
  for (std::size_t i = 0; i < basis.size(); ++i)
    functions[at + 1].known[basis.chosen.empty() ? i : basis.chosen[i]] =
        term.coefficients[static_cast<Eigen::Index>(i)];
  return functions;
}

/// The functions of a term over two open factors whose coefficients are nearly a product, as the time after one kind of command is.
std::vector<Factor> functions_of_pair(const Term& term) {
  constexpr double kShare = 0.8;  // of the sum of squares of the coefficients
  const std::optional<FactorPair> pair = pair_of(term);
  if (!pair || pair->one.of_two() || pair->other.of_two()) return {};
  // Curves over what only rises stand for much else, as for a circle that grows.
  if (only_rises(pair->one.axis) || only_rises(pair->other.axis)) return {};
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pair->one.columns()),
                                                 static_cast<Eigen::Index>(pair->other.columns()));
  for (std::size_t k = 0; k < pair->at.size(); ++k)
    matrix(pair->at[k].first, pair->at[k].second) = term.coefficients[static_cast<Eigen::Index>(k)];
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const double largest = svd.singularValues()[0];
  if (!(largest > 0) || largest * largest < kShare * matrix.squaredNorm()) return {};
  const Eigen::VectorXd of_one = svd.matrixU().col(0), of_other = largest * svd.matrixV().col(0);
  std::vector<Factor> functions{pair->one, pair->other};
  functions[0].known.assign(of_one.begin(), of_one.end());
  functions[1].known.assign(of_other.begin(), of_other.end());
  return functions;
}

}  // namespace

std::vector<Factor> functions_of(const Term& term) {
  if (term.general || term.blocks.empty()) return {};
  if (std::vector<Factor> functions = functions_of_switch(term); !functions.empty()) return functions;
  std::vector<Factor> functions;
  std::optional<Factor> open = function_of(term);
  if (!open) {
    // A product of known functions, with one coefficient.
    functions = term.blocks.front().basis.factors;
    if (term.coefficients.size() != 1 || functions.empty()) return functions_of_pair(term);
    scale(functions.back(), term.coefficients[0]);
    return functions;
  }
  for (const Factor& f : term.blocks.front().basis.factors)
    if (!f.known.empty()) functions.push_back(f);
  functions.push_back(*open);
  return functions;
}

}  // namespace kilotwin::identify

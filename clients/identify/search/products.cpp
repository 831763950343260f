#include "clients/identify/search/products.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/total_variation_map.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Nodes along each axis of a smooth map as known values: five per half-wave of its finest column.
constexpr std::uint32_t kNodes = 97;
/// A step this long before all data is a constant, s.
constexpr double kAlways_s = 1e6;

bool is_of_place(const Factor& f) { return f.axis.of == Covariate::kX || f.axis.of == Covariate::kY; }

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

/// The sum of the open parts of a term as one factor with known coefficients.
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
  if (count > 1 || open->open->of_two()) return sampled(summands, term.blocks.front().target);
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

/// The coefficients of a term as a matrix over the columns of its two open factors.
struct Pair {
  Factor one, other;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> at;  ///< row and column of each coefficient
};

/// The blocks of a term that act on one target: two open factors each, of which the first continues the cosines of the block before.
/// Nothing: another term.
std::optional<Pair> pair_of(const Term& term) {
  Pair pair;
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

/// The functions of a term over two open factors whose coefficients are nearly a product, as the time after one kind of command is.
std::vector<Factor> functions_of_pair(const Term& term) {
  constexpr double kShare = 0.8;  // of the sum of squares of the coefficients
  const std::optional<Pair> pair = pair_of(term);
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

/// How rich a function is. The richest stays open.
int richness(const Factor& f) {
  // A curve along one axis may become a map.
  if (f.of_two() || (is_of_place(f) && f.shape == Shape::kCosines)) return 4;
  if (f.shape == Shape::kTable) return 0;
  if (f.shape == Shape::kAtLeast) return 1;
  return f.shape == Shape::kHarmonics ? 2 : 3;
}

/// The open factor with few columns or many that a function is fitted with. It includes a constant where it can: gains of
/// different blocks multiply, so a constant in a block of its own would not add up with the rest.
Factor shape_of(Factor f, bool rich) {
  f.known.clear();
  f.plus = 0;
  // A single block, which has no columns beside it along the axes: a higher order than that of a map on its own.
  constexpr std::uint32_t kCoarse = 12, kCoarseMap = 6, kRichMap = 15, kCoarseHarmonics = 4;
  switch (f.shape) {
    case Shape::kGrid:
    case Shape::kCosines2:
      f.shape = Shape::kCosines2;
      f.points.clear();
      f.first = 0;
      f.count = rich ? kRichMap : kCoarseMap;
      return f;
    case Shape::kLinear:
    case Shape::kCosines:
      if (rich || f.shape == Shape::kLinear) f = richer(f);
      f.first = 0;
      if (!rich) f.count = std::min(f.count, kCoarse);
      return f;
    case Shape::kHarmonics:
      f = richer(f);
      if (!rich) f.count = std::min(f.count, kCoarseHarmonics);
      f.count += f.first;
      f.first = 0;
      return f;
    case Shape::kAtLeast: f.points.insert(f.points.begin(), -kAlways_s); return f;
    default: return rich ? richer(f) : f;
  }
}

/// A typical largest absolute value of a function. Of curves: an upper bound.
double size_of(const Factor& f) {
  // Share of a grid's nodes above the size; with 0, one node that chance made high would decide.
  constexpr double kTail = 0.02;
  std::vector<double> values;
  if (f.shape == Shape::kGrid) {
    for (const double v : f.points) values.push_back(std::abs(f.known[0] * v));
    return stats::upper_end(values, static_cast<std::size_t>(kTail * static_cast<double>(values.size())));
  }
  if (f.shape != Shape::kTable) {
    double sum = std::abs(f.plus);
    for (const double k : f.known) sum += std::abs(k);
    return sum;
  }
  for (const double k : f.known) values.push_back(std::abs(f.plus + k));
  return *std::max_element(values.begin(), values.end());
}

void scale(Factor& f, double by) {
  f.plus *= by;
  for (double& k : f.known) k *= by;
}

/// Normalises known tables to a mean of 1, which is the value of an unseen key. If the mean is near 0, the largest becomes 1.
void about_the_mean(Term& term) {
  const std::vector<Factor> like = term.blocks.front().basis.factors;
  for (std::size_t i = 0; i + 1 < like.size(); ++i) {
    if (like[i].shape != Shape::kTable || like[i].known.empty()) continue;
    const Eigen::Map<const Eigen::ArrayXd> each(like[i].known.data(),
                                                static_cast<Eigen::Index>(like[i].known.size()));
    const double mean = like[i].plus + each.mean(), most = (like[i].plus + each).abs().maxCoeff();
    if (most == 0) continue;
    // Share of the largest amplitude; a mean below it is near 0, and would make the table's values huge.
    constexpr double kNextToNone = 0.2;
    const double unit = std::abs(mean) > kNextToNone * most ? mean : most;
    const Eigen::ArrayXd about = (like[i].plus + each - mean) / unit;
    for (Block& block : term.blocks) {
      Factor& table = block.basis.factors[i];
      table.plus = mean / unit;
      table.known.assign(about.begin(), about.end());
    }
    term.coefficients *= unit;
    term.precision /= unit * unit;
  }
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

ProductFit::ProductFit(const Fitter& fitter, FitState& state, std::size_t place, std::vector<Factor> functions)
    : fitter_(fitter),
      state_(state),
      place_(place),
      target_(state.model.terms[place].blocks.front().target),
      during_(state.model.terms[place].blocks.front().during),
      functions_(std::move(functions)) {
  std::stable_sort(functions_.begin(), functions_.end(),
                   [](const Factor& a, const Factor& b) { return richness(a) < richness(b); });
  costs_.assign(functions_.size(), 0);
  term().general = false;
  put_known();
}

/// All functions known: one column.
void ProductFit::put_known() {
  // Weak prior of the amplitude: a standard deviation of 10; a larger value pulls it towards 0.
  constexpr double kPrecision = 0.01;
  term().blocks = {{target_, Basis{functions_}, during_}};
  term().coefficients = Eigen::VectorXd::Ones(1);
  term().precision = Eigen::VectorXd::Constant(1, kPrecision);
}

void ProductFit::normalise(std::size_t i) {
  if (const double size = size_of(functions_[i]); size > 0) scale(functions_[i], 1 / size);
}

/// One open function times the others.
std::vector<Block> ProductFit::blocks_of(std::size_t open, bool rich) const {
  Basis basis{functions_};
  std::rotate(basis.factors.begin() + static_cast<std::ptrdiff_t>(open),
              basis.factors.begin() + static_cast<std::ptrdiff_t>(open) + 1, basis.factors.end());
  basis.factors.back() = shape_of(functions_[open], rich);
  return {{target_, basis, during_}};
}

/// Fits one function with the others fixed.
void ProductFit::turn(std::size_t open, bool rich, int passes) {
  put_known();
  const std::vector<Factor> before = functions_;
  for (std::size_t i = 0; i < functions_.size(); ++i)
    if (i != open) normalise(i);
  drop_steps(open);
  if (rich) choose_place_form(open);
  refine_to(fitter_, state_, place_, blocks_of(open, rich), passes);
  if (const std::optional<Factor> found = function_of(term())) {
    functions_[open] = *found;
    return;
  }
  functions_ = before;
  put_known();
}

void ProductFit::note_cost(std::size_t open) {
  const LocalQuadratic l = local_quadratic(fitter_, state_, place_, {});
  const ReducedColumns now = reduced_columns(l, l.score, l.term_columns());
  const Eigen::VectorXd sd = term().precision.cwiseInverse().cwiseSqrt();
  costs_[open] = -log_evidence(now.information, Eigen::VectorXd::Zero(sd.size()), sd);
}

double ProductFit::cost() const {
  double sum = 0;
  for (const double cost : costs_) sum += cost;
  return sum;
}

double ProductFit::cost_of_known() const {
  const std::vector<Factor>& factors = state_.model.terms[place_].blocks.front().basis.factors;
  const bool open = std::any_of(factors.begin(), factors.end(), [](const Factor& f) { return f.known.empty(); });
  return open ? cost() - costs_.back() : cost();
}

/// A function of what only rises in a run that steps explain better becomes steps. It is open.
void ProductFit::became_steps(std::size_t open) {
  if (!only_rises(functions_[open].axis) || functions_[open].shape != Shape::kCosines) return;
  (void)find_change_points(fitter_, state_, place_);
  const Factor* const found = term().blocks.front().basis.only_open();
  if (found == nullptr || found->shape != Shape::kAtLeast || found->points.back() < 0) return;
  if (const std::optional<Factor> steps = function_of(term())) functions_[open] = *steps;
}

/// Removes steps whose evidence does not pay for the choice of their instants: they were found beside other functions that had
/// not converged.
void ProductFit::drop_steps(std::size_t open) {
  constexpr double kPrice = 8;  // log of the number of instants, and the size
  Factor& steps = functions_[open];
  if (steps.shape != Shape::kAtLeast || steps.points.size() < 2) return;
  const std::vector<Block> blocks = blocks_of(open, false);
  const LocalQuadratic l = local_quadratic(fitter_, state_, place_, blocks);
  const ReducedColumns data = reduced_columns(l, l.score_without(term().coefficients), l.added_columns());
  const auto evidence = [&](const std::vector<Eigen::Index>& columns) {
    ColumnGroup group;
    for (std::size_t i = 0; i < columns.size(); ++i) group.columns.push_back(static_cast<Eigen::Index>(i));
    group.roughness.assign(columns.size(), 0);
    std::vector<Smoothness> smoothness;
    Eigen::VectorXd sd;
    return choose_smoothness(data.information(columns, columns), data.score(columns), {group}, smoothness, sd);
  };
  const auto n = static_cast<Eigen::Index>(steps.points.size());
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i <= n; ++i) kept.push_back(i);  // the constant is first
  double had = evidence(kept);
  while (kept.size() > 2) {
    std::vector<Eigen::Index> best;
    double most = had - kPrice;
    for (std::size_t k = 1; k < kept.size(); ++k) {
      std::vector<Eigen::Index> fewer = kept;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
      const double value = evidence(fewer);
      if (value <= most) continue;
      most = value;
      best = std::move(fewer);
    }
    if (best.empty()) break;
    had = most;
    kept = std::move(best);
  }
  Factor fewer = steps;
  fewer.points.clear();
  fewer.known.clear();
  for (std::size_t k = 1; k < kept.size(); ++k) {
    fewer.points.push_back(steps.points[static_cast<std::size_t>(kept[k]) - 1]);
    fewer.known.push_back(steps.known[static_cast<std::size_t>(kept[k]) - 1]);
  }
  steps = fewer;
}

/// A function of position: a map, or a curve along one axis. The largest evidence decides, once.
void ProductFit::choose_place_form(std::size_t open) {
  const Factor had = functions_[open];
  const bool may = had.shape == Shape::kGrid || had.shape == Shape::kCosines2 || had.shape == Shape::kCosines;
  if (!may || !is_of_place(had) || std::exchange(place_form_chosen_, true)) return;
  const Factor map = plane(extent_of(state_.tracks), 1);
  std::vector<Factor> candidates{map, map, map};
  for (std::size_t i = 1; i < candidates.size(); ++i) candidates[i].shape = Shape::kCosines;
  candidates[2].axis = map.and_axis;
  candidates[2].low = map.and_low;
  candidates[2].high = map.and_high;
  std::vector<std::vector<Block>> forms;
  std::vector<Block> all;
  for (const Factor& one : candidates) {
    functions_[open] = one;
    forms.push_back(blocks_of(open, true));
    all.insert(all.end(), forms.back().begin(), forms.back().end());
  }
  const LocalQuadratic l = local_quadratic(fitter_, state_, place_, all);
  const Eigen::VectorXd score = l.score_without(term().coefficients);
  std::size_t best = 0;
  double most = 0;
  Eigen::Index next = l.own;
  for (std::size_t f = 0; f < forms.size(); ++f) {
    std::vector<ColumnGroup> groups;
    std::vector<Eigen::Index> columns;
    for (const Block& block : forms[f]) {
      ColumnGroup& group = groups.emplace_back();
      for (const double rough : block.basis.roughness()) {
        group.columns.push_back(static_cast<Eigen::Index>(columns.size()));
        group.roughness.push_back(rough);
        columns.push_back(next++);
      }
    }
    const ReducedColumns data = reduced_columns(l, score, columns);
    std::vector<Smoothness> smoothness;
    Eigen::VectorXd sd;
    const double evidence = choose_smoothness(data.information, data.score, groups, smoothness, sd);
    if (f > 0 && evidence <= most) continue;
    best = f;
    most = evidence;
  }
  functions_[open] = candidates[best];
}

/// A map with edges becomes a grid of values. It is open.
bool ProductFit::became_grid(std::size_t open) {
  if (!functions_[open].of_two() || !is_of_place(functions_[open])) return false;
  fit_total_variation_map(fitter_, state_, place_);
  const Factor* const found = term().blocks.front().basis.only_open();
  if (found == nullptr || found->shape != Shape::kGrid) return false;
  if (const std::optional<Factor> grid = function_of(term())) functions_[open] = *grid;
  return true;
}

/// The map at its nodes, with one open coefficient.
void ProductFit::reopen_grid(std::size_t open) {
  put_known();
  Term& product = term();
  Factor& grid = product.blocks.front().basis.factors[open];
  product.coefficients[0] = grid.known[0];
  grid.known.clear();
}

void ProductFit::fit() {
  // Bounds on the rounds over all functions, first in coarse and then in rich shapes, and passes of a fit in a new rich
  // shape. More cost a fit per function each.
  constexpr int kMostRounds = 8, kMostRichRounds = 3, kPasses = 3;
  // Nat; a round that gains less ends the loop; a smaller value adds rounds that gain little.
  constexpr double kSettled = 2;
  const std::size_t n = functions_.size(), last = n - 1;
  fitter_.fit(state_, 1);
  double likelihood = fitter_.log_likelihood(state_);
  for (int round = 0; round < kMostRounds; ++round) {
    for (std::size_t i = 0; i < n; ++i) turn(i, false, 1);
    const double now = fitter_.log_likelihood(state_);
    if (std::exchange(likelihood, now) + kSettled > now) break;
  }
  for (std::size_t i = n; i-- > 0;) {
    if (richness(functions_[i]) < 2 && i != last) continue;
    turn(i, true, kPasses);
    became_steps(i);
  }
  // Again, with the other functions in their rich shapes.
  const auto turn_others = [&] {
    for (std::size_t i = 0; i < last; ++i) {
      turn(i, true, 1);
      became_steps(i);
      note_cost(i);
    }
  };
  for (int round = 0; round < kMostRichRounds; ++round) {
    turn_others();
    turn(last, true, round == 0 ? kPasses : 1);
    const double now = fitter_.log_likelihood(state_);
    if (std::exchange(likelihood, now) + kSettled > now) break;
  }
  note_cost(last);
  const bool grid = became_grid(last);
  if (grid) turn_others();
  if (grid) reopen_grid(last);
  // Its columns include the constant: written as known steps.
  const bool steps = functions_[last].shape == Shape::kAtLeast;
  if (steps) put_known();
  if (grid || steps) fitter_.fit(state_, 1);
  about_the_mean(term());
}

namespace {

/// Separable coefficients that fit best: the vectors of both factors, and their gain in log likelihood.
struct RankOne {
  Eigen::VectorXd one, other;
  double gain = 0;
};

/// The best vector of one factor with that of the other fixed.
double best_half(const Pair& pair, const ReducedColumns& data, const Eigen::VectorXd& precision, bool rows,
                 const Eigen::VectorXd& fixed, Eigen::VectorXd& found) {
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(data.score.size(), found.size());
  for (std::size_t k = 0; k < pair.at.size(); ++k) {
    const auto [i, j] = pair.at[k];
    z(static_cast<Eigen::Index>(k), rows ? i : j) = fixed[rows ? j : i];
  }
  Eigen::MatrixXd information = z.transpose() * (data.information * z);
  const Eigen::VectorXd score = z.transpose() * data.score;
  Eigen::MatrixXd with = information + Eigen::MatrixXd(z.transpose() * precision.asDiagonal() * z);
  with.diagonal().array() += 1e-9 * std::max(with.diagonal().maxCoeff(), 1e-300);
  found = with.ldlt().solve(score);
  return score.dot(found) - 0.5 * found.dot(information * found);
}

/// Alternating least squares on the quadratic approximation, from the largest row of the coefficients.
RankOne rank_one(const Pair& pair, const ReducedColumns& data, const Term& term) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pair.one.columns()),
                                                 static_cast<Eigen::Index>(pair.other.columns()));
  for (std::size_t k = 0; k < pair.at.size(); ++k)
    matrix(pair.at[k].first, pair.at[k].second) = term.coefficients[static_cast<Eigen::Index>(k)];
  Eigen::Index largest = 0;
  matrix.rowwise().squaredNorm().maxCoeff(&largest);
  RankOne out{Eigen::VectorXd::Zero(matrix.rows()), matrix.row(largest).transpose(), 0};
  // Alternations between the two halves, which are cheap: no filter runs; fewer may end before they agree.
  constexpr int kRounds = 40;
  for (int round = 0; round < kRounds; ++round) {
    if (out.other.norm() == 0) return out;
    out.other.normalize();
    best_half(pair, data, term.precision, true, out.other, out.one);
    if (out.one.norm() == 0) return out;
    out.one.normalize();
    out.gain = best_half(pair, data, term.precision, false, out.one, out.other);
  }
  return out;
}

Factor with_known(Factor f, const Eigen::VectorXd& coefficients, Target target) {
  if (f.of_two()) {
    Term map{"", {{target, Basis{{f}}}}, coefficients, Eigen::VectorXd::Ones(coefficients.size())};
    if (const std::optional<Factor> grid = function_of(map)) return *grid;
  }
  f.known.assign(coefficients.begin(), coefficients.end());
  return f;
}

}  // namespace

namespace {

/// The blocks of a term on one target, and their columns among those of the term.
struct OneTarget {
  Term term;
  std::vector<Eigen::Index> columns;
};
std::vector<OneTarget> by_target(const Term& term) {
  std::vector<OneTarget> all;
  Eigen::Index next = 0;
  for (const Block& block : term.blocks) {
    auto own = std::find_if(all.begin(), all.end(), [&](const OneTarget& one) {
      return one.term.blocks.front().target == block.target && one.term.blocks.front().during == block.during;
    });
    if (own == all.end()) {
      all.push_back({{term.name, {}, {}, {}}, {}});
      own = all.end() - 1;
    }
    own->term.blocks.push_back(block);
    for (std::size_t i = 0; i < block.basis.size(); ++i) own->columns.push_back(next++);
  }
  for (OneTarget& one : all) {
    one.term.coefficients = term.coefficients(one.columns);
    one.term.precision = term.precision(one.columns);
  }
  return all;
}

/// The product acts on a further target, too, with an amplitude of its own: a drift has a direction.
void add_target(Term& product, const std::vector<Factor>& functions, const Block& like) {
  constexpr double kPrecision = 0.01;  // weak prior of the amplitude, as in put_known
  product.blocks.push_back({like.target, Basis{functions}, like.during});
  const Eigen::Index had = product.coefficients.size();
  product.coefficients.conservativeResize(had + 1);
  product.precision.conservativeResize(had + 1);
  product.coefficients[had] = 0;
  product.precision[had] = kPrecision;
}

}  // namespace

Term main_part(const Term& term) {
  if (term.blocks.empty() || !is_gain(term.blocks.front().target)) return term;
  std::vector<OneTarget> targets = by_target(term);
  return std::max_element(targets.begin(), targets.end(),
                          [](const OneTarget& a, const OneTarget& b) {
                            return a.term.coefficients.norm() < b.term.coefficients.norm();
                          })
      ->term;
}

bool separate(const Fitter& fitter, FitState& state, std::size_t place) {
  // Share of the main target's gain that the product form must keep to be fitted. A larger value gives up sooner; a smaller
  // one costs fits of forms that fail.
  constexpr double kLeastShare = 0.5;
  const Term& term = state.model.terms[place];
  const std::vector<OneTarget> targets = by_target(term);
  if (std::any_of(targets.begin(), targets.end(), [](const OneTarget& one) {
        return !pair_of(one.term) || is_measured(one.term.blocks.front().target);
      }))
    return false;
  const LocalQuadratic l = local_quadratic(fitter, state, place, {});
  const ReducedColumns all = reduced_columns(l, l.score_without(term.coefficients), l.term_columns());
  // Of a target's columns, with those of the others at their values.
  const auto data_of = [&](const OneTarget& one) {
    Eigen::VectorXd others = term.coefficients;
    others(one.columns).setZero();
    return ReducedColumns{all.information(one.columns, one.columns),
                          (all.score - all.information * others)(one.columns)};
  };
  const auto gain_of = [&](const OneTarget& one) {
    const ReducedColumns data = data_of(one);
    const Eigen::VectorXd& c = one.term.coefficients;
    return data.score.dot(c) - 0.5 * c.dot(data.information * c);
  };
  const OneTarget& main =
      *std::max_element(targets.begin(), targets.end(),
                        [&](const OneTarget& a, const OneTarget& b) { return gain_of(a) < gain_of(b); });
  const Pair pair = *pair_of(main.term);
  const RankOne one = rank_one(pair, data_of(main), main.term);
  if (!(one.gain > kLeastShare * gain_of(main))) return false;
  const Eigen::VectorXd sd = term.precision.cwiseInverse().cwiseSqrt();
  const double cost = -log_evidence(all.information, Eigen::VectorXd::Zero(sd.size()), sd),
               value = fitter.log_likelihood(state) - cost;
  FitState trial = state;
  trial.model.terms[place] = main.term;
  const Target target = main.term.blocks.front().target;
  ProductFit product(fitter, trial, place,
                     {with_known(pair.one, one.one, target), with_known(pair.other, one.other, target)});
  product.fit();
  const std::vector<Factor> functions = functions_of(trial.model.terms[place]);
  if (functions.empty()) return false;
  for (const OneTarget& other : targets)
    if (&other != &main) add_target(trial.model.terms[place], functions, other.term.blocks.front());
  if (targets.size() > 1) fitter.fit(trial, 2);
  // Negated, so that a likelihood that is no number does not count.
  if (!(fitter.log_likelihood(trial) - product.cost() > value)) return false;
  state = std::move(trial);
  return true;
}

namespace {

/// Gives a table of robots a key for each robot of the tracks, with the value of an unseen one.
void add_robots(Factor& table, const std::vector<std::uint32_t>& robots) {
  if (table.axis.of != Covariate::kRobot) return;
  for (const std::uint32_t robot : robots) {
    const auto at = std::lower_bound(table.points.begin(), table.points.end(), robot);
    if (at != table.points.end() && *at == robot) continue;
    table.known.insert(table.known.begin() + (at - table.points.begin()), 0);
    table.points.insert(at, robot);
  }
}

/// Keys without data, which have no column and the value 0, get the mean of the others.
void fill_with_mean(Factor& table) {
  const auto none = std::count(table.known.begin(), table.known.end(), 0.0);
  const auto others = static_cast<double>(table.known.size()) - static_cast<double>(none);
  if (others == 0) return;
  const double mean = std::accumulate(table.known.begin(), table.known.end(), 0.0) / others;
  std::replace(table.known.begin(), table.known.end(), 0.0, mean);
}

bool is_same_table(const Factor& a, const Factor& b) {
  return a.shape == b.shape && a.axis == b.axis && a.points == b.points && a.known == b.known && a.plus == b.plus;
}

/// Opens the known table at `place` among the factors of a product, fits it, and puts its new values in place of the old ones.
void refit_table(const Fitter& fitter, FitState& state, std::size_t t, std::size_t place) {
  Term kept = state.model.terms[t];
  std::vector<Factor> functions = functions_of(kept);
  const std::vector<Factor> factors = kept.blocks.front().basis.factors;
  const Factor& old = factors[place];
  // Known factors come first, in their order.
  const auto known = [](const Factor& f) { return !f.known.empty(); };
  const auto at = functions.begin() +
                  std::count_if(factors.begin(), factors.begin() + static_cast<std::ptrdiff_t>(place), known);
  if (at >= functions.end() || at->shape != Shape::kTable) return;
  // Without an open function the last one has the coefficient of the term.
  const bool has_coefficient = at + 1 == functions.end();
  std::rotate(at, at + 1, functions.end());
  double unit = 1;
  for (std::size_t i = 0; i + 1 < functions.size(); ++i) {
    const double size = size_of(functions[i]);
    if (!(size > 0)) return;
    scale(functions[i], 1 / size);
    unit *= size;
  }
  add_robots(functions.back(), extent_of(state.tracks).robots);
  functions.back() = shape_of(functions.back(), false);
  FitState trial = state;
  refine_to(fitter, trial, t, {{kept.blocks.front().target, Basis{functions}, kept.blocks.front().during}}, 1);
  std::optional<Factor> table = function_of(trial.model.terms[t]);
  if (!table) return;
  fill_with_mean(*table);
  scale(*table, 1 / unit);
  for (Block& block : kept.blocks)
    for (Factor& factor : block.basis.factors)
      if (is_same_table(factor, old)) factor = *table;
  if (has_coefficient) {
    kept.precision *= kept.coefficients[0] * kept.coefficients[0];
    kept.coefficients.setOnes();
  }
  about_the_mean(kept);
  trial.model.terms[t] = std::move(kept);
  fitter.fit(trial, 2);
  // Negated, so that a likelihood that is no number does not count.
  if (!(fitter.log_likelihood(trial) > fitter.log_likelihood(state))) return;
  state = std::move(trial);
}

}  // namespace

void refit_tables(const Fitter& fitter, FitState& state) {
  for (std::size_t t = 0; t < state.model.terms.size(); ++t) {
    if (functions_of(state.model.terms[t]).size() < 2) continue;
    const std::size_t factors = state.model.terms[t].blocks.front().basis.factors.size();
    for (std::size_t i = 0; i < factors; ++i) {
      const Factor& factor = state.model.terms[t].blocks.front().basis.factors[i];
      if (factor.shape == Shape::kTable && !factor.known.empty()) refit_table(fitter, state, t, i);
    }
  }
}

}  // namespace kilotwin::identify

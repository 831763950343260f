#include "clients/identify/search/products.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/product_functions.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/total_variation_map.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// A step this long before all data is a constant, s.
constexpr double kAlways_s = 1e6;
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

std::vector<double> evidence_of_forms(const Fitter& fitter, const FitState& state, std::size_t place,
                                      const std::vector<std::vector<Block>>& forms) {
  std::vector<Block> all;
  for (const std::vector<Block>& form : forms) all.insert(all.end(), form.begin(), form.end());
  const LocalQuadratic l = local_quadratic(fitter, state, place, all);
  const Eigen::VectorXd score = l.score_without(state.model.terms[place].coefficients);
  std::vector<double> evidence;
  Eigen::Index next = l.own;
  for (const std::vector<Block>& form : forms) {
    std::vector<ColumnGroup> groups;
    std::vector<Eigen::Index> columns;
    for (const Block& block : form) {
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
    evidence.push_back(choose_smoothness(data.information, data.score, groups, smoothness, sd));
  }
  return evidence;
}

double fit_product(const Fitter& fitter, FitState& state, std::size_t place, std::vector<Factor> functions) {
  ProductFit product(fitter, state, place, std::move(functions));
  product.fit();
  fitter.fit_until_settled(state);
  return fitter.log_evidence(state) - product.cost_of_known();
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
  term().blocks = {{target_, Basis{functions_}, during_}};
  term().coefficients = Eigen::VectorXd::Ones(1);
  term().precision = Eigen::VectorXd::Constant(1, kAmplitudePrecision);
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
  for (const Factor& one : candidates) {
    functions_[open] = one;
    forms.push_back(blocks_of(open, true));
  }
  const std::vector<double> evidence = evidence_of_forms(fitter_, state_, place_, forms);
  const std::size_t best =
      static_cast<std::size_t>(std::max_element(evidence.begin(), evidence.end()) - evidence.begin());
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

#include "clients/identify/search/simplification.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Exponentials with different lengths, steps at different points and single harmonics that are tried in place of a curve.
/// More cost a column each and raise the price of the choice; a finer raster follows about the best one.
constexpr int kScales = 12, kSteps = 30, kHarmonics = 3;
/// Largest loss of log evidence of a simple form.
constexpr double kMostEvidenceLost = 1;
/// The same before the refit, absolute and as a share of the evidence: parameters lie on a coarse raster, and the
/// quadratic approximation is rough.
constexpr double kRoughly = 40, kRoughShare = 0.04;

/// One simple form for all blocks of a term.
struct SimpleForm {
  Basis basis;
  double log_choices = 0;  ///< log of the number of alternatives
  Eigen::Index first = 0;  ///< first column among those of all forms
};

/// The common curve over one covariate of all blocks; null if there is none.
const Factor* curve_of(const Term& term) {
  const Factor* curve = nullptr;
  for (const Block& block : term.blocks) {
    if (is_measured(block.target) || block.basis.factors.size() != 1) return nullptr;
    const Factor& f = block.basis.factors.front();
    if ((f.shape != Shape::kCosines && f.shape != Shape::kHarmonics) || !f.known.empty()) return nullptr;
    if (curve != nullptr && (curve->shape != f.shape || !(curve->axis == f.axis))) return nullptr;
    for (const Block& other : term.blocks)
      if (&other != &block && other.target == block.target && (other.during & block.during) != 0) return nullptr;
    curve = &f;
  }
  return curve;
}

SimpleForm form(const Factor& like, Shape shape, double choices, std::vector<double> points = {},
                std::uint32_t first = 1) {
  Factor f;
  f.shape = shape;
  f.axis = like.axis;
  f.low = like.low;
  f.high = like.high;
  f.first = first;
  f.points = std::move(points);
  return {Basis{{f}}, std::log(choices)};
}

std::vector<SimpleForm> forms_of(const Factor& curve, Target target) {
  std::vector<SimpleForm> forms;
  // A constant gain is not identifiable: base speeds absorb it.
  if (target != Target::kGain && target != Target::kGainLeft && target != Target::kGainRight) forms.push_back({});
  if (curve.shape == Shape::kHarmonics) {
    for (std::uint32_t k = 1; k <= kHarmonics; ++k)
      forms.push_back(form(curve, Shape::kHarmonics, kHarmonics, {}, k));
    return forms;
  }
  forms.push_back(form(curve, Shape::kLinear, 1));
  const double range = curve.high - curve.low;
  // Covariates that may be negative: an exponential has no start there.
  const bool place = curve.axis.of == Covariate::kX || curve.axis.of == Covariate::kY ||
                     curve.axis.of == Covariate::kPointDistance || curve.axis.of == Covariate::kAlong;
  for (int i = 0; i < kScales && !place; ++i)
    forms.push_back(form(curve, Shape::kExponential, kScales, {range * std::pow(0.66, i)}));
  // change_points.hpp handles time.
  if (curve.axis.of == Covariate::kTime) return forms;
  for (int i = 1; i < kSteps; ++i)
    forms.push_back(form(curve, Shape::kAtLeast, kSteps, {curve.low + range * i / kSteps}));
  return forms;
}

struct BestForm {
  const SimpleForm* form = nullptr;
  double evidence = 0;
  Eigen::VectorXd sd;
  std::vector<Eigen::Index> columns;  ///< among those of all forms
};

BestForm best_of(const std::vector<SimpleForm>& forms, const ReducedColumns& data, std::size_t blocks) {
  BestForm best;
  for (const SimpleForm& one : forms) {
    std::vector<Eigen::Index> columns(one.basis.size() * blocks);
    std::iota(columns.begin(), columns.end(), one.first);
    const Eigen::MatrixXd information = data.information(columns, columns);
    const Eigen::VectorXd score = data.score(columns);
    const double top = information.diagonal().maxCoeff();
    if (!(top > 0)) continue;
    double size = 1 / std::sqrt(top);
    while (size < 4000 / std::sqrt(top)) {
      const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
      const double evidence = log_evidence(information, score, sd) - one.log_choices - 1;
      if (best.form == nullptr || evidence > best.evidence) best = {&one, evidence, sd, columns};
      size *= 3;
    }
  }
  return best;
}

/// Blocks of all forms for all targets of the term. Assigns the forms their columns.
std::vector<Block> blocks_of(std::vector<SimpleForm>& forms, const Term& term) {
  std::vector<Block> blocks;
  Eigen::Index next = 0;
  for (SimpleForm& one : forms) {
    one.first = next;
    for (const Block& block : term.blocks) {
      blocks.push_back({block.target, one.basis, block.during});
      next += static_cast<Eigen::Index>(one.basis.size());
    }
  }
  return blocks;
}

/// Replaces the term by the best form if its evidence suffices, or in any case. Returns false if it does not.
bool put_best(const Fitter& fitter, FitState& state, std::size_t place, std::vector<SimpleForm>& forms,
              bool in_any_case) {
  const Term& term = state.model.terms[place];
  const LocalQuadratic l = local_quadratic(fitter, state, place, blocks_of(forms, term));
  const Eigen::VectorXd score = l.score_without(term.coefficients);
  const ReducedColumns now = reduced_columns(l, score, l.term_columns());
  const double had = log_evidence(now.information, now.score, term.precision.cwiseInverse().cwiseSqrt());
  const BestForm best = best_of(forms, reduced_columns(l, score, l.added_columns()), term.blocks.size());
  if (best.form == nullptr) return false;
  if (!in_any_case && best.evidence < had - kRoughly - kRoughShare * std::abs(had)) return false;
  std::vector<Eigen::Index> columns;
  for (const Eigen::Index c : best.columns) columns.push_back(l.own + c);
  std::vector<Block> blocks;
  for (const Block& block : term.blocks) blocks.push_back({block.target, best.form->basis, block.during});
  replace_blocks(state.model, place, l, blocks, score, columns, best.sd);
  return true;
}

/// Complexity of a term: half the log determinant of its posterior precision relative to the prior.
double cost_of(const Fitter& fitter, const FitState& state, std::size_t place) {
  const LocalQuadratic l = local_quadratic(fitter, state, place, {});
  const ReducedColumns now = reduced_columns(l, l.score, l.term_columns());
  const Eigen::VectorXd sd = state.model.terms[place].precision.cwiseInverse().cwiseSqrt();
  return -log_evidence(now.information, Eigen::VectorXd::Zero(sd.size()), sd);
}

/// A table times a curve over time, both open, after any known factors; null: another term.
const Factor* amplitudes_over_time(const Term& term) {
  if (term.blocks.size() != 1 || is_measured(term.blocks.front().target)) return nullptr;
  const std::vector<Factor>& factors = term.blocks.front().basis.factors;
  const auto open = std::find_if(factors.begin(), factors.end(), [](const Factor& f) { return f.known.empty(); });
  if (factors.end() - open != 2 || !factors.back().known.empty()) return nullptr;
  const Factor &table = *open, &curve = factors.back();
  const bool over_time = curve.shape == Shape::kCosines &&
                         (curve.axis.of == Covariate::kTime || curve.axis.of == Covariate::kDrivenTime);
  return table.shape == Shape::kTable && over_time ? &table : nullptr;
}

/// Amplitudes of some keys that begin at one instant, which lies in a span.
struct SwitchGroup {
  Factor table;
  double low_s, high_s;
};

Block beginning(const Block& like, const Factor& curve, const SwitchGroup& group, std::vector<double> at_s) {
  Block block = like;
  const std::vector<Factor> known(like.basis.factors.begin(), like.basis.factors.end() - 2);
  block.basis = form(curve, Shape::kAtLeast, 1, std::move(at_s)).basis;
  block.basis.factors.push_back(group.table);
  block.basis.factors.insert(block.basis.factors.begin(), known.begin(), known.end());
  return block;
}

/// The chosen instant of each group on a raster: its index, or none.
struct ChosenInstants {
  std::vector<std::optional<std::size_t>> at;
  double sd = 0, evidence = 0;
};

/// `points`: instants per group. Columns: by group, then by instant, then by key.
ChosenInstants choose_instants(const ReducedColumns& data, const std::vector<SwitchGroup>& groups,
                               std::size_t points) {
  ChosenInstants best;
  const double smallest = 1 / std::sqrt(std::max(data.information.diagonal().maxCoeff(), 1e-12));
  double sd = smallest;
  while (sd < 4000 * smallest) {
    ChosenInstants trial{{}, sd, 0};
    Eigen::Index next = 0;
    for (const SwitchGroup& group : groups) {
      const auto keys = static_cast<Eigen::Index>(group.table.points.size());
      double most = 0;
      trial.at.emplace_back();
      for (std::size_t i = 0; i < points; ++i, next += keys) {
        const double evidence = log_evidence(data.information.block(next, next, keys, keys),
                                             data.score.segment(next, keys), Eigen::VectorXd::Constant(keys, sd)) -
                                std::log(static_cast<double>(points));
        if (!(evidence > most)) continue;
        most = evidence;
        trial.at.back() = i;
      }
      trial.evidence += most;
    }
    if (trial.evidence > best.evidence) best = std::move(trial);
    sd *= 3;
  }
  return best;
}

/// The term as amplitudes that begin at one instant per group, on finer and finer rasters. Groups without evidence for an
/// instant are left out. Nothing if none has one.
std::optional<FitState> with_switches(const Fitter& fitter, FitState state, std::size_t place, const Factor& curve,
                                      std::vector<SwitchGroup> groups) {
  // Instants of the first raster and of the finer ones. More cost a column per key each; too few in the first one miss the
  // instant.
  constexpr std::size_t kFirst = 12, kNext = 6;
  const Block like = state.model.terms[place].blocks.front();
  for (std::size_t points = kFirst; groups.front().high_s - groups.front().low_s > 1; points = kNext) {
    std::vector<Block> blocks;
    std::vector<std::vector<double>> rasters;
    for (const SwitchGroup& group : groups) {
      std::vector<double>& at_s = rasters.emplace_back();
      for (std::size_t i = 1; i <= points; ++i)
        at_s.push_back(group.low_s +
                       static_cast<double>(i) * (group.high_s - group.low_s) / static_cast<double>(points + 1));
      const auto each = std::max<std::size_t>(1, kMostColumns / group.table.points.size());
      for (std::size_t first = 0; first < points; first += each) {
        const auto end = at_s.begin() + static_cast<std::ptrdiff_t>(std::min(points, first + each));
        blocks.push_back(beginning(like, curve, group, {at_s.begin() + static_cast<std::ptrdiff_t>(first), end}));
      }
    }
    const LocalQuadratic l = local_quadratic(fitter, state, place, blocks);
    const Eigen::VectorXd score = l.score_without(state.model.terms[place].coefficients);
    const ChosenInstants chosen = choose_instants(reduced_columns(l, score, l.added_columns()), groups, points);
    std::vector<SwitchGroup> kept;
    std::vector<Block> put;
    std::vector<Eigen::Index> columns;
    Eigen::Index next = l.own;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto keys = static_cast<Eigen::Index>(groups[g].table.points.size());
      const Eigen::Index first = next;
      next += keys * static_cast<Eigen::Index>(points);
      if (chosen.at.empty() || !chosen.at[g]) continue;
      const double at_s = rasters[g][*chosen.at[g]],
                   apart_s = (groups[g].high_s - groups[g].low_s) / static_cast<double>(points + 1);
      put.push_back(beginning(like, curve, groups[g], {at_s}));
      for (Eigen::Index k = 0; k < keys; ++k)
        columns.push_back(first + static_cast<Eigen::Index>(*chosen.at[g]) * keys + k);
      kept.push_back({groups[g].table, at_s - apart_s, at_s + apart_s});
    }
    if (kept.empty()) return std::nullopt;
    replace_blocks(state.model, place, l, put, score, columns,
                   Eigen::VectorXd::Constant(static_cast<Eigen::Index>(columns.size()), chosen.sd));
    groups = std::move(kept);
  }
  state.model.terms[place].general = false;
  fitter.fit(state, 2);
  return state;
}

}  // namespace

bool simplify_to_switch(const Fitter& fitter, FitState& state, std::size_t place) {
  const Factor* const factors = amplitudes_over_time(state.model.terms[place]);
  if (factors == nullptr || factors[0].points.empty() || factors[0].points.size() > kMostColumns / 2) return false;
  const Factor table = factors[0], curve = factors[1];
  const std::vector<SwitchGroup> together{{table, curve.low, curve.high}};
  std::vector<SwitchGroup> each;
  for (const double key : table.points) {
    each.push_back({table, curve.low, curve.high});
    each.back().table.points = {key};
  }
  double best = fitter.log_likelihood(state) - cost_of(fitter, state, place);
  bool replaced = false;
  const FitState curves = state;
  for (const std::vector<SwitchGroup>& groups : {together, each}) {
    // Groups with an instant of their own; with more, all begin together or keep their curves.
    constexpr std::size_t kMostGroups = 24;
    if (groups.size() > kMostGroups) continue;
    std::optional<FitState> trial = with_switches(fitter, curves, place, curve, groups);
    if (!trial) continue;
    constexpr double kChoice = 5;  // log of the number of instants
    const auto instants = groups.size() == 1 ? 1 : trial->model.terms[place].blocks.size();
    const double value =
        fitter.log_likelihood(*trial) - cost_of(fitter, *trial, place) - kChoice * static_cast<double>(instants);
    // Negated, so that a likelihood that is no number does not count.
    if (!(value > best)) continue;
    best = value;
    replaced = true;
    state = std::move(*trial);
  }
  return replaced;
}

bool is_constant_drift(const Term& term) {
  const auto is_constant = [](const Block& block) {
    return block.basis.factors.empty() && (block.target == Target::kWorldX || block.target == Target::kWorldY);
  };
  const auto acts_while_driven = [](const Block& block) { return (block.during & kDriven) != 0; };
  return std::all_of(term.blocks.begin(), term.blocks.end(), is_constant) &&
         std::any_of(term.blocks.begin(), term.blocks.end(), acts_while_driven);
}

bool simplify(const Fitter& fitter, FitState& state, std::size_t place) {
  if (simplify_to_switch(fitter, state, place)) return true;
  const Factor* const curve = curve_of(state.model.terms[place]);
  if (curve == nullptr || state.model.terms[place].coefficients.size() < 2) return false;
  std::vector<SimpleForm> forms = forms_of(*curve, state.model.terms[place].blocks.front().target);
  FitState simple = state;
  if (!put_best(fitter, simple, place, forms, false)) return false;
  const std::vector<Factor>& factors = simple.model.terms[place].blocks.front().basis.factors;
  if (!factors.empty() &&
      (factors.front().shape == Shape::kExponential || factors.front().shape == Shape::kAtLeast)) {
    // A finer raster around the optimum.
    const Factor found = factors.front();
    std::vector<SimpleForm> finer;
    for (int i = -6; i <= 6; ++i) {
      const double at = found.shape == Shape::kExponential
                            ? found.points[0] * std::pow(1.07, i)
                            : found.points[0] + (found.high - found.low) * i / (6.0 * kSteps);
      if (at > 0 || found.shape == Shape::kAtLeast) finer.push_back(form(found, found.shape, 1, {at}));
    }
    put_best(fitter, simple, place, finer, true);
  }
  const double likelihood = fitter.fit_for_likelihood(simple, 2);
  const double lost = fitter.log_likelihood(state) - likelihood;
  if (lost > cost_of(fitter, state, place) - cost_of(fitter, simple, place) + kMostEvidenceLost) return false;
  state = std::move(simple);
  return true;
}

}  // namespace kilotwin::identify

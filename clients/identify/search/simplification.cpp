#include "clients/identify/search/simplification.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

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
  const bool place = curve.axis.of == Covariate::kX || curve.axis.of == Covariate::kY;
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
    for (double size = 1 / std::sqrt(top); size < 4000 / std::sqrt(top); size *= 3) {
      const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
      const double evidence = log_evidence(information, score, sd) - one.log_choices - 1;
      if (best.form == nullptr || evidence > best.evidence) best = {&one, evidence, sd, columns};
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

/// A table times a curve over time, both open; null: another term.
const Factor* amplitudes_over_time(const Term& term) {
  if (term.blocks.size() != 1 || is_measured(term.blocks.front().target)) return nullptr;
  const std::vector<Factor>& factors = term.blocks.front().basis.factors;
  if (factors.size() != 2 || !factors[0].known.empty() || !factors[1].known.empty()) return nullptr;
  const bool over_time = factors[1].shape == Shape::kCosines &&
                         (factors[1].axis.of == Covariate::kTime || factors[1].axis.of == Covariate::kDrivenTime);
  return factors[0].shape == Shape::kTable && over_time ? factors.data() : nullptr;
}

/// Replaces curves of robots or commands over time by amplitudes that begin at one instant, if those do as well.
bool simplify_to_switch(const Fitter& fitter, FitState& state, std::size_t place) {
  const Factor* const factors = amplitudes_over_time(state.model.terms[place]);
  if (factors == nullptr || factors[0].points.empty() || factors[0].points.size() > kMostColumns / 2) return false;
  const Factor table = factors[0], curve = factors[1];
  const Block like = state.model.terms[place].blocks.front();
  const auto keys = static_cast<Eigen::Index>(table.points.size());
  const auto each = std::max<std::size_t>(1, kMostColumns / table.points.size());
  constexpr std::size_t kFirst = 12, kNext = 6;
  FitState simple = state;
  double low_s = curve.low, high_s = curve.high;
  for (std::size_t points = kFirst; high_s - low_s > 1; points = kNext) {
    const double apart_s = (high_s - low_s) / static_cast<double>(points + 1);
    std::vector<double> at;
    for (std::size_t i = 1; i <= points; ++i) at.push_back(low_s + static_cast<double>(i) * apart_s);
    std::vector<Block> blocks;
    for (std::size_t first = 0; first < points; first += each) {
      Block block = like;
      const auto end = at.begin() + static_cast<std::ptrdiff_t>(std::min(points, first + each));
      Factor begins =
          form(curve, Shape::kAtLeast, 1, {at.begin() + static_cast<std::ptrdiff_t>(first), end}).basis.factors[0];
      block.basis = Basis{{begins, table}};
      blocks.push_back(std::move(block));
    }
    const LocalQuadratic l = local_quadratic(fitter, simple, place, blocks);
    const Eigen::VectorXd score = l.score_without(simple.model.terms[place].coefficients);
    const ReducedColumns data = reduced_columns(l, score, l.added_columns());
    std::vector<SimpleForm> instants;
    for (std::size_t i = 0; i < points; ++i) {
      SimpleForm one = form(curve, Shape::kAtLeast, 1, {at[i]});
      one.basis.factors.push_back(table);
      one.first = static_cast<Eigen::Index>(i) * keys;
      instants.push_back(std::move(one));
    }
    const BestForm best = best_of(instants, data, 1);
    if (best.form == nullptr) return false;
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index c : best.columns) columns.push_back(l.own + c);
    replace_blocks(simple.model, place, l, {{like.target, best.form->basis, like.during}}, score, columns, best.sd);
    const double found_s = best.form->basis.factors.front().points.front();
    low_s = found_s - apart_s;
    high_s = found_s + apart_s;
  }
  simple.model.terms[place].general = false;
  fitter.fit(simple, 2);
  constexpr double kChoice = 5;  // log of the number of instants
  const double lost = fitter.log_likelihood(state) - fitter.log_likelihood(simple);
  if (lost > cost_of(fitter, state, place) - cost_of(fitter, simple, place) - kChoice) return false;
  state = std::move(simple);
  return true;
}

}  // namespace

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
      if (at > 0) finer.push_back(form(found, found.shape, 1, {at}));
    }
    put_best(fitter, simple, place, finer, true);
  }
  fitter.fit(simple, 2);
  const double lost = fitter.log_likelihood(state) - fitter.log_likelihood(simple);
  if (lost > cost_of(fitter, state, place) - cost_of(fitter, simple, place) + kMostEvidenceLost) return false;
  state = std::move(simple);
  return true;
}

}  // namespace kilotwin::identify

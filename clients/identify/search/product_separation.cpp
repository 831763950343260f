/// Separation of terms over two covariates into products of two functions.
#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/product_functions.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/target_extension.hpp"

namespace kilotwin::identify {
namespace {

/// Separable coefficients that fit best: the vectors of both factors, and their gain in log likelihood.
struct RankOne {
  Eigen::VectorXd one, other;
  double gain = 0;
};

/// The best vector of one factor with that of the other fixed.
double best_half(const FactorPair& pair, const ReducedColumns& data, const Eigen::VectorXd& precision, bool rows,
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
RankOne rank_one(const FactorPair& pair, const ReducedColumns& data, const Term& term) {
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
  product.blocks.push_back({like.target, Basis{functions}, like.during});
  const Eigen::Index had = product.coefficients.size();
  product.coefficients.conservativeResize(had + 1);
  product.precision.conservativeResize(had + 1);
  product.coefficients[had] = 0;
  product.precision[had] = kAmplitudePrecision;
}

}  // namespace

Term main_part(const Term& term) {
  if (term.blocks.empty() || !is_gain(term.blocks.front().target)) return term;
  std::vector<OneTarget> targets = by_target(term);
  // The numbers of other targets have other units.
  std::erase_if(targets, [](const OneTarget& one) { return !is_gain(one.term.blocks.front().target); });
  return std::max_element(targets.begin(), targets.end(),
                          [](const OneTarget& a, const OneTarget& b) {
                            return a.term.coefficients.norm() < b.term.coefficients.norm();
                          })
      ->term;
}

bool is_part_of_product(const Term& part, const Term& product) {
  const std::vector<Factor> all = functions_of(product), own = functions_of(main_part(part));
  if (all.size() < 2 || own.empty() || main_part(part).blocks.front().target != product.blocks.front().target)
    return false;
  return std::all_of(own.begin(), own.end(), [&](const Factor& f) {
    return std::any_of(all.begin(), all.end(), [&](const Factor& g) { return f.axis == g.axis; });
  });
}

void refit_product(const Fitter& fitter, FitState& state, std::size_t place) {
  ProductFit product(fitter, state, place, functions_of(state.model.terms[place]));
  product.fit();
  extend_targets(fitter, state, place);
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
  const FactorPair pair = *pair_of(main.term);
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

}  // namespace kilotwin::identify

#include "clients/identify/fit/term_values.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

/// The products of a basis at the places of its factors. `like`: the block's own basis, of which a left-out factor counts as 1 only
/// where it is unchanged.
Eigen::VectorXd columns_at(const Basis& basis, const Basis& like, const std::vector<FactorPlace>& places) {
  Eigen::VectorXd products = Eigen::VectorXd::Ones(1);
  for (std::size_t f = 0; f < basis.factors.size(); ++f) {
    const Factor& factor = basis.factors[f];
    Eigen::VectorXd own(static_cast<Eigen::Index>(factor.size()));
    if (places[f].left_out)
      own.setConstant(factor == like.factors[f] ? 1 : 0);
    else
      factor.evaluate_at(places[f].value, places[f].and_value, own.data());
    Eigen::VectorXd next(products.size() * own.size());
    for (Eigen::Index i = 0; i < products.size(); ++i) next.segment(i * own.size(), own.size()) = products[i] * own;
    products = std::move(next);
  }
  if (basis.chosen.empty()) return products;
  Eigen::VectorXd chosen(static_cast<Eigen::Index>(basis.chosen.size()));
  for (std::size_t i = 0; i < basis.chosen.size(); ++i)
    chosen[static_cast<Eigen::Index>(i)] = products[basis.chosen[i]];
  return chosen;
}

}  // namespace

TermValues::TermValues(const MotionModel& model, const Uncertainty& uncertainty, std::size_t term)
    : term_(model.terms[term]) {
  Eigen::Index before = kBaseColumns, coefficients = kBaseColumns;
  std::size_t first_block = 0;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    coefficients += model.terms[t].coefficients.size();
    if (t >= term) continue;
    before += model.terms[t].coefficients.size();
    first_block += model.terms[t].blocks.size();
  }
  Eigen::Index next = 0;
  for (const Block& block : term_.blocks) {
    first_.push_back(next);
    next += static_cast<Eigen::Index>(block.basis.size());
  }
  const HeldNumbers& held = uncertainty.held;
  Eigen::Index first_held = held.size(), held_count = 0;
  for (Eigen::Index i = held.size(); i-- > 0;) {
    if (held.numbers[static_cast<std::size_t>(i)].term != term) continue;
    first_held = i;
    ++held_count;
  }
  Eigen::Index column = 0;
  for (std::size_t b = 0; b < held.columns.blocks.size(); ++b) {
    const Basis& basis = held.columns.blocks[b].basis;
    const auto n = static_cast<Eigen::Index>(basis.size());
    const std::size_t of = held.columns.of_block[b];
    if (of >= first_block && of < first_block + term_.blocks.size())
      changes_.push_back({of - first_block, &basis, held.columns.weights.block(column, first_held, n, held_count)});
    column += n;
  }
  std::vector<Eigen::Index> own;
  for (Eigen::Index i = 0; i < next; ++i) own.push_back(before + i);
  for (Eigen::Index i = 0; i < held_count; ++i) own.push_back(coefficients + first_held + i);
  covariance_ = uncertainty.all(own, own);
}

ValueWithSd TermValues::at(const std::vector<BlockPlace>& places) const {
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(covariance_.rows());
  const Eigen::Index coefficients = term_.coefficients.size();
  for (const BlockPlace& place : places) {
    const Basis& basis = term_.blocks[place.block].basis;
    const Eigen::VectorXd own = columns_at(basis, basis, place.factors);
    slopes.segment(first_[place.block], own.size()) += own;
  }
  const double value = slopes.head(coefficients).dot(term_.coefficients);
  for (const BlockPlace& place : places) {
    const Basis& basis = term_.blocks[place.block].basis;
    for (const Change& change : changes_) {
      if (change.of != place.block) continue;
      const Eigen::VectorXd changed = change.weights.transpose() * columns_at(*change.basis, basis, place.factors);
      slopes.tail(changed.size()) += changed;
    }
  }
  return {value, std::sqrt(std::max(0.0, slopes.dot(covariance_ * slopes)))};
}

}  // namespace kilotwin::identify

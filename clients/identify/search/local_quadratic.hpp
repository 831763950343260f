/// A model and blocks of columns beside it or in place of one of its terms, linearised about the model: what refinements of a
/// term are weighed on.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// All that a model has, and more blocks after it.
struct Linear {
  std::vector<Unit> units;
  Eigen::MatrixXd information;
  Eigen::VectorXd score;              ///< with the prior of what the model has, but for the term
  Eigen::VectorXd prior;              ///< precision of the columns of the model, but for the term's
  Eigen::Index first = 0, count = 0;  ///< the columns of the term that is looked at
  Eigen::Index own = 0;               ///< columns of the model; those of the other blocks come after them

  /// Columns of the model but for the term's.
  [[nodiscard]] std::vector<Eigen::Index> others() const;
  /// Columns of the other blocks.
  [[nodiscard]] std::vector<Eigen::Index> more() const;
  /// Columns of the term.
  [[nodiscard]] std::vector<Eigen::Index> of_term() const;
  /// The score where the term's coefficients were 0.
  [[nodiscard]] Eigen::VectorXd score_without(const Eigen::VectorXd& coefficients) const;
};

/// The other blocks stand in place of the term; with `beside`, beside it.
[[nodiscard]] Linear linear(const Fitter&, const MotionModel&, std::size_t term, const std::vector<Block>& more,
                            bool beside = false);

/// Information and score of some columns beside the model's own but for the term's.
struct Beside {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
};
[[nodiscard]] Beside beside(const Linear&, const Eigen::VectorXd& score, const std::vector<Eigen::Index>& columns);

/// Puts blocks in place of the term's, whose columns are `columns` with these standard deviations beforehand: all moves with
/// them as the linearised data have it. `score` is that without the term.
void exchange(MotionModel&, std::size_t term, const Linear&, const std::vector<Block>&,
              const Eigen::VectorXd& score, const std::vector<Eigen::Index>& columns, const Eigen::VectorXd& sd);

}  // namespace kilotwin::identify

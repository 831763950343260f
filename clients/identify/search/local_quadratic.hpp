/// Quadratic approximation of the log likelihood about a model, with further blocks added to the model or in place
/// of one of its terms. Shape refinement and model comparison use it.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Information and score of the model's columns and of further blocks.
struct LocalQuadratic {
  std::vector<Unit> units;
  Eigen::MatrixXd information;
  Eigen::VectorXd score;              ///< prior included, except that of the replaced term
  Eigen::VectorXd prior;              ///< prior precision of the model's columns, except those of the replaced term
  Eigen::Index first = 0, count = 0;  ///< columns of the replaced term
  Eigen::Index own = 0;               ///< number of the model's columns; those of the further blocks follow

  /// The model's columns except the replaced term's.
  [[nodiscard]] std::vector<Eigen::Index> other_columns() const;
  /// Columns of the further blocks.
  [[nodiscard]] std::vector<Eigen::Index> added_columns() const;
  /// Columns of the replaced term.
  [[nodiscard]] std::vector<Eigen::Index> term_columns() const;
  /// The score at coefficients 0 of the replaced term.
  [[nodiscard]] Eigen::VectorXd score_without(const Eigen::VectorXd& coefficients) const;
};

/// `beside`: the blocks are added to the term instead of replacing it.
[[nodiscard]] LocalQuadratic local_quadratic(const Fitter&, const FitState&, std::size_t term,
                                             const std::vector<Block>& more, bool beside = false);

/// Information and score of some columns after the elimination of the nuisance columns (Schur complement).
struct ReducedColumns {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
};
[[nodiscard]] ReducedColumns reduced_columns(const LocalQuadratic&, const Eigen::VectorXd& score,
                                             const std::vector<Eigen::Index>& columns);

/// Replaces the term's blocks. `columns` are those of the new blocks, `sd` their prior standard deviations,
/// `score` the score without the term. All other parameters move to the maximum of the quadratic approximation.
void replace_blocks(MotionModel&, std::size_t term, const LocalQuadratic&, const std::vector<Block>&,
                    const Eigen::VectorXd& score, const std::vector<Eigen::Index>& columns,
                    const Eigen::VectorXd& sd);

}  // namespace kilotwin::identify

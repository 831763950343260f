/// Refinement of an effect's shape: many columns with a smoothness prior, whose hyperparameters maximise the
/// evidence (empirical Bayes).
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Prior of a group of columns: a column of roughness k has the variance size^2 (1 + (k / knee)^2)^-decay.
struct Smoothness {
  double size = 1, knee = 4, decay = 2;

  [[nodiscard]] double sd(double roughness) const;
};

/// Log evidence of coefficients b ~ N(0, sd^2) over b = 0, from information and score at 0 (Laplace
/// approximation).
[[nodiscard]] double log_evidence(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                  const Eigen::VectorXd& sd);

/// Columns that share their hyperparameters, and the roughness of each.
struct ColumnGroup {
  std::vector<Eigen::Index> columns;
  std::vector<double> roughness;
};
/// Maximises the evidence over the hyperparameters of every group. Returns it, and the standard deviations of all
/// columns in `sd`.
double choose_smoothness(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                         const std::vector<ColumnGroup>& groups, std::vector<Smoothness>& smoothness,
                         Eigen::VectorXd& sd);

/// A factor over the same covariates with the columns of a refined shape.
[[nodiscard]] Factor richer(Factor);
/// Replaces the term's bases by rich ones and refits the model until it converges.
void refine_curves(const Fitter&, FitState&, std::size_t term);
/// The same with given blocks. `passes`: most alternations of the smoothness and the fit.
void refine_to(const Fitter&, FitState&, std::size_t term, const std::vector<Block>&, int passes = 5);
/// Refits the term with its present bases.
void refit(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

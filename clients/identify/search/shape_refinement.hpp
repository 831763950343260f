/// Gives a cause that was found with few columns the shape that the data support: many columns, of which the prior lets
/// only so much bend as makes the data most probable.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// How large and how rough the functions of a group of columns are beforehand: a column with roughness k has the variance
/// size^2 (1 + (k / knee)^2)^-decay.
struct Smoothness {
  double size = 1, knee = 4, decay = 2;

  [[nodiscard]] double sd(double roughness) const;
};

/// Log marginal likelihood of coefficients that have these standard deviations beforehand, over that of none, from the
/// information and the score at 0.
[[nodiscard]] double log_evidence(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                                  const Eigen::VectorXd& sd);

/// Columns that belong to one group, and how rough each is.
struct ColumnGroup {
  std::vector<Eigen::Index> columns;
  std::vector<double> roughness;
};
/// The smoothness of every group that makes the data most probable; `sd` gets the standard deviations of all columns.
/// Returns the log evidence.
double choose_smoothness(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                         const std::vector<ColumnGroup>& groups, std::vector<Smoothness>& smoothness,
                         Eigen::VectorXd& sd);

/// Puts rich bases in place of those of a term, and fits all of the model until it stays as it is.
void refine(const Fitter&, MotionModel&, std::size_t term);
/// The same with the bases that it has.
void settle(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

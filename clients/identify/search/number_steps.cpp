#include "clients/identify/search/number_steps.hpp"

#include <Eigen/Cholesky>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"

namespace kilotwin::identify {
namespace {

Eigen::VectorXd next_step(const Fitter& fitter, const FitState& state, const NumberSteps& steps) {
  const LocalQuadratic l = local_quadratic(fitter, state, state.model.terms.size(), steps.slopes(state), true);
  const Eigen::Index n = l.information.rows() - l.own;
  Eigen::MatrixXd information = l.information;
  information.diagonal() += l.prior;
  information.diagonal().tail(n).array() += 1 / (steps.largest_step * steps.largest_step);
  return information.ldlt().solve(l.score).tail(n);
}

}  // namespace

bool move_numbers(const Fitter& fitter, FitState& state, const NumberSteps& steps, double& likelihood) {
  bool moved = false;
  for (int pass = 0; pass < steps.most; ++pass) {
    const Eigen::VectorXd step = next_step(fitter, state, steps);
    bool better = false;
    for (const double length : {1.0, 0.4, 0.16}) {
      FitState trial = state;
      steps.move(trial, length * step);
      const double found = fitter.fit_for_likelihood(trial, 2);
      // Negated, so that a likelihood that is no number is no progress.
      if (!(found > likelihood + steps.least_rise)) continue;
      likelihood = found;
      state = std::move(trial);
      better = moved = true;
      break;
    }
    if (!better) break;
  }
  return moved;
}

}  // namespace kilotwin::identify

/// Gauss-Newton steps of numbers that the fit of coefficients holds: centres of circles, wave numbers.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

struct NumberSteps {
  /// Blocks whose columns are the derivatives of the effect by the numbers, in order.
  std::function<std::vector<Block>(const FitState&)> slopes;
  /// Moves the numbers by a step, one entry per column.
  std::function<void(FitState&, const Eigen::VectorXd& step)> move;
  int most = 6;
  double least_rise = 1;           ///< of the log likelihood; a smaller one ends the steps
  double largest_step = INFINITY;  ///< prior standard deviation of a step
};

/// Moves the numbers until the log likelihood settles, at each step with all other parameters refitted; a step that is too long is
/// shortened. `likelihood`: of the state, before and after. Returns whether it rose.
bool move_numbers(const Fitter&, FitState&, const NumberSteps&, double& likelihood);

}  // namespace kilotwin::identify

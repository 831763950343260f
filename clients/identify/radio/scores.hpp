/// Distances between simulated and measured grids.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/radio/grid_data.hpp"

namespace kilotwin::radio_fit {

/// Pairs with the same absolute difference of rows and columns.
struct DisplacementClass {
  int rows = 0, columns = 0;
  double distance_mm = 0;
  double reception = 0;  ///< mean over pairs and runs
};

/// Summary statistics of a set of runs.
struct Statistics {
  double sent = 0;           ///< mean per robot
  double sender_spread = 0;  ///< sd over senders of their mean reception by others
  double silent = 0;         ///< share of (pair, run) with reception below 2 %
  double run_spread = 0;     ///< mean over pairs of the sd over runs
  double near = 0;           ///< mean reception up to 105 mm
  double partial = 0;        ///< share of (pair, run) at 125..200 mm with reception 2..60 %
  std::vector<DisplacementClass> classes;
};
[[nodiscard]] Statistics statistics(const GridSet& set);

/// Simulated minus measured.
struct Errors {
  Statistics simulated;
  double sent = 0;        ///< differences, simulated - measured
  double near_worst = 0;  ///< largest absolute difference of a displacement class up to 105 mm
  double far_worst = 0;   ///< the same beyond 125 mm, over classes with any reception
  double silent = 0, sender_spread = 0, run_spread = 0;
  double log_likelihood = 0;  ///< of the measured counts, nat per pair and run
  double deficit = 0;         ///< relative to the reference runs, nat per pair and run
};

/// `reference`: the training runs. Their own means and dispersions bound what a model of these robots can reach.
[[nodiscard]] Errors compare(const GridSet& measured, const GridSet& simulated, const GridSet& reference);

/// Log likelihood of counts: beta-binomial per pair with the mean and dispersion in `model`; nat per pair and run.
[[nodiscard]] double log_likelihood(const GridSet& measured, const GridSet& model);

}  // namespace kilotwin::radio_fit

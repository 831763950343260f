/// How far simulated grids are from measured ones.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/radio/grid_data.hpp"

namespace kilotwin::radio_fit {

/// Pairs whose places differ by the same numbers of rows and columns, whatever the direction.
struct DisplacementClass {
  int rows = 0, columns = 0;
  double distance_mm = 0;
  double reception = 0;  ///< mean over pairs and runs
};

/// What a set of runs looks like.
struct Statistics {
  double sent = 0;           ///< mean per robot
  double sender_spread = 0;  ///< sd over the senders of the mean share that others received of them
  double silent = 0;         ///< share of (pair, run) that received less than 2 %
  double run_spread = 0;     ///< mean over pairs of the sd over runs
  double near = 0;           ///< mean reception up to 105 mm
  double partial = 0;        ///< share of (pair, run) of 125..200 mm that received some, 2..60 %
  std::vector<DisplacementClass> classes;
};
[[nodiscard]] Statistics statistics(const GridSet& set);

/// Simulated against measured.
struct Errors {
  Statistics simulated;
  double sent = 0;        ///< differences, simulated - measured
  double near_worst = 0;  ///< largest |difference| of a displacement class up to 105 mm
  double far_worst = 0;   ///< beyond 125 mm, of classes that anybody hears
  double silent = 0, sender_spread = 0, run_spread = 0;
  double log_likelihood = 0;  ///< of the measured counts, nat per pair and run
  double deficit = 0;         ///< to that of the reference runs, nat per pair and run
};

/// `reference`: the runs that were fitted to; their own means and dispersions are what a model of these robots can reach.
[[nodiscard]] Errors compare(const GridSet& measured, const GridSet& simulated, const GridSet& reference);

/// Log-likelihood of counts, each pair being beta-binomial with the mean and dispersion that it has in `model`; nat per pair
/// and run.
[[nodiscard]] double log_likelihood(const GridSet& measured, const GridSet& model);

}  // namespace kilotwin::radio_fit

/// The loop on measured grids of robots: from the seed's model of the radio to the full one, effect by effect, each with what
/// in the data points to it and the errors on runs that were not fitted to.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace kilotwin::radio_fit {

struct FitOptions {
  std::filesystem::path train,
      test;  ///< directories of comm_tau*_run*.dat; test empty: every other run of each set is held out
  std::filesystem::path out;
  bool swap = false;  ///< fit to the half that is else held out, and test on the other
  int runs = 40;      ///< simulated for each effect and set
  int swarms = 200;   ///< drawn from the fitted population
  /// Gets how far the work is, 0..1, and what each effect showed; none: that is said on the screen.
  std::function<void(double, const std::string&)> progress = {};
};

/// Writes model.txtpb (range, pattern and spreads), model-SET.txtpb (with that set's 25 robots), result.json, effects.md (the
/// table) and figures. Throws UserError where the data cannot be read.
void fit_radio(const FitOptions& options);

}  // namespace kilotwin::radio_fit

/// Fit of the radio model to measured grids: from the ARGoS model to the full one, effect by effect, with the
/// evidence in the residuals and the errors on held-out runs.
#pragma once

#include <filesystem>
#include <string>

#include "core/stats/time_left.hpp"
#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::radio_fit {

struct FitOptions {
  std::filesystem::path train,
      test;  ///< directories of comm_tau*_run*.dat; test empty: holds out every other run of each set
  std::filesystem::path out;
  bool swap = false;        ///< exchanges training and held-out half
  int runs = 40;            ///< simulated runs per effect and set
  int swarms = 200;         ///< random swarms of the fitted population
  bool placements = false;  ///< also writes placements.md: the sets beside swarms of other placements
  /// Receives the result of each effect, as the work that follows it; none: they are printed.
  stats::WorkReport progress = {};
};

struct RadioFound {
  identification::RadioFit fit;
  proto::Model model;  ///< range, pattern and variances, fitted to all sets; robots and pairs are random
};

/// Writes model.txtpb, model-SET.txtpb (with the robots of that set), result.json, effects.md (table), placements.md if asked
/// for, and figures into `out`. Throws UserError on unreadable data.
RadioFound fit_radio(const FitOptions& options);

}  // namespace kilotwin::radio_fit

/// The study of radio counts: a fit of the radio model to measured grids. It goes from the ARGoS model to the full one, effect by
/// effect. Each has its evidence in the residuals, and its errors on held-out runs.
#pragma once

#include <filesystem>
#include <memory>

#include "clients/identify/study.hpp"

namespace kilotwin::radio_fit {

struct RadioData {
  std::filesystem::path train,
      test;           ///< directories of comm_tau*_run*.dat; test empty: holds out every other run of each set
  bool swap = false;  ///< exchanges training and held-out half
};

/// By default some minutes of one core in total.
struct RadioWork {
  int runs = 24;            ///< simulated runs per effect and set
  int swarms = 80;          ///< random swarms of the fitted population
  bool placements = false;  ///< also writes placements.md: the sets beside swarms of other placements
};

/// Whether a directory holds such counts.
[[nodiscard]] bool has_radio_runs(const std::filesystem::path& directory);

/// Its report() writes into `out`: model.txtpb, model-SET.txtpb (with the robots of that set), result.json, effects.md (table),
/// placements.md if asked for, and figures. Without a report of progress in the options, the result of each effect is printed. Throws
/// UserError on unreadable data.
[[nodiscard]] std::unique_ptr<identify::Study> radio_study(const RadioData&, const RadioWork&,
                                                           std::filesystem::path out, const identify::Options&);

}  // namespace kilotwin::radio_fit

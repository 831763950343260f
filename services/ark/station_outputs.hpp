/// Where plugins' outputs go: failures to the user, logs and reports to the run directory, floors to the observer.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/federation/run_observer.hpp"
#include "core/plan/plan.hpp"
#include "services/ark/station_engine.hpp"

namespace kilotwin::ark {

/// Files of the run directory, N being the environment's index: station-N.tsv, the log; station-N.json, the last report.
class StationOutputs {
 public:
  /// An empty `run_directory`: no files, and failures are not said. Logs of an earlier attempt keep the rows before `first`.
  StationOutputs(const RunPlan& plan, std::filesystem::path run_directory, Tick first);

  /// Writes the output of the engine's last step, from tick `from`. Throws RunError where a plugin's failure ends the run, or a
  /// file cannot be written.
  void take(Tick from, const StationEngine& engine, RunObserver& observer);

 private:
  void write(const PluginOutput&);

  const RunPlan& plan_;
  const std::filesystem::path run_directory_;
  std::map<std::uint32_t, FloorPicture> floors_;  ///< the last one of each environment
};

/// The station's counters until tick `last`.
[[nodiscard]] StationTotals station_totals(const RunPlan& plan, const StationEngine& engine, Tick last);

}  // namespace kilotwin::ark

/// A local run: all engines in this process, called directly, on any number of threads, without DDS.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/federation/checkpoint.hpp"
#include "core/federation/run_observer.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::local {

struct LocalOptions {
  std::uint32_t threads = 1;
  std::filesystem::path run_directory;  ///< holds the programs; gets checkpoints, logs and the robots' EEPROMs
  std::optional<Checkpoint> resumed;    ///< the checkpoint from which the run continues
  /// Recorded external inputs, applied at their ticks. Pauses are ignored.
  std::vector<Directive> inputs;
  /// The samples of trackers that were stamped for a tick; asked once per tick, in order. Empty: there are none.
  std::function<std::vector<TrackerSample>(Tick)> tracker_samples;
  bool save_checkpoints = true;  ///< false: writes neither checkpoints nor logs
};

/// Runs the plan to its end or until SIGINT or SIGTERM; RunTotals::failure then is "interrupted". Throws RunError if a
/// checkpoint or a log cannot be written.
RunTotals run(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
              const LocalOptions& options, RunObserver& observer);

}  // namespace kilotwin::local

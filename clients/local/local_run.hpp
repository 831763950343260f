/// A run in this process: the same engines, called directly, on any number of threads, with no DDS on the path.
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
  std::filesystem::path run_directory;  ///< where programs are; where checkpoints, logs and robots' EEPROMs go
  std::optional<Checkpoint> resumed;
  /// Stamped inputs of an earlier run, to be applied at their ticks; pauses are passed over.
  std::vector<Directive> inputs;
  bool save_checkpoints = true;  ///< and logs
};

/// Runs the plan to its end, or until the process is interrupted, which the totals then name as their failure. Throws
/// RunError where a checkpoint cannot be written.
RunTotals run(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
              const LocalOptions& options, RunObserver& observer);

}  // namespace kilotwin::local

#include "clients/cli/local_worker.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "clients/cli/progress.hpp"
#include "clients/cli/recovery.hpp"
#include "clients/cli/run_recorder.hpp"
#include "clients/cli/run_report.hpp"
#include "clients/local/local_run.hpp"
#include "core/base/error.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::cli {

void run_in_this_process(const RunPlan& plan, const recorder::RunDirectory& directory, std::uint32_t threads,
                         bool quiet, double started_s) {
  local::LocalOptions options;
  options.threads = threads;
  options.run_directory = directory.path();
  Beginning beginning = beginning_of(plan, directory);
  options.resumed = std::move(beginning.resumed);
  options.inputs = std::move(beginning.inputs);
  options.tracker_samples = [stamped = std::move(beginning.tracker_samples),
                             next = std::size_t{0}](Tick tick) mutable {
    std::vector<TrackerSample> samples;
    for (; next < stamped.size() && stamped[next].first <= tick; ++next) samples.push_back(stamped[next].second);
    return samples;
  };
  const auto programs = behaviours::ProgramSet::load(plan, directory.path());
  ProgressBar progress(plan, !quiet);
  RunRecorder run_recorder(plan, directory, options.resumed, [&](const RunProgress& now) { progress.show(now); });
  const RunTotals totals = local::run(plan, programs, options, run_recorder);
  progress.clear();
  const double first_tick_s =
      std::chrono::duration<double>(run_recorder.first_tick_at().time_since_epoch()).count();
  run_recorder.finish(totals, first_tick_s - started_s);
  if (!totals.failure.empty()) {
    if (!quiet) write_run_report(directory);
    throw RunError(fmt::format("{}; what was recorded so far is in {}", totals.failure, directory.path().string()));
  }
}

}  // namespace kilotwin::cli

/// A sweep as one array job of Slurm.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clients/cli/sweep_runs.hpp"

namespace kilotwin::cli {

struct SlurmOptions {
  std::vector<std::string> for_sbatch;
  std::string program;  ///< what starts kilotwin on the nodes, for a shell; empty: this program's path
};

/// Writes DIR/commands, a line per run, and DIR/array.sbatch, submits it, waits for its end, and calls `ended` for each run. A run whose
/// element did not come to its end counts as failed. DIR/slurm-job holds the job's id until it has ended.
/// Returns false if this process is interrupted; the job is cancelled then. Throws RunError where there is no Slurm, it refuses the job,
/// or it does not answer for some minutes; the job goes on then.
[[nodiscard]] bool run_on_slurm(std::vector<SweepRun>& runs, const std::filesystem::path& directory,
                                const SlurmOptions& options, const std::function<void(const SweepRun&)>& ended);

/// Throws UserError while a job that an earlier call has submitted for this directory may still write there.
void require_no_job(const std::filesystem::path& directory);

}  // namespace kilotwin::cli

#include "clients/cli/sweep_slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "clients/cli/progress.hpp"
#include "clients/cli/shell_words.hpp"
#include "clients/cli/sweep_state.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/process.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

/// Slurm's default MaxArraySize is 1001; beyond it, an element does several runs.
constexpr std::size_t kMostElements = 1000;
constexpr auto kQueuePoll = std::chrono::seconds(1);
/// A controller that restarts, or is busy, does not answer for a while. Its jobs run on.
constexpr auto kSlurmPatience = std::chrono::minutes(10);

fs::path required_tool(const char* name) {
  fs::path tool = os::find_executable(name);
  if (tool.empty())
    throw RunError(
        fmt::format("--slurm: no {} on this machine; submit from a node of the cluster that has it", name));
  return tool;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// A line per run. Its log and exit status stand beside its directory.
std::string commands_of(const std::vector<SweepRun>& runs, const std::string& program) {
  const std::string start = program.empty() ? shell_word(fs::read_symlink("/proc/self/exe").string()) : program;
  std::string text;
  for (const SweepRun& run : runs) {
    std::string line = start;
    for (std::size_t i = 1; i < run.words.size(); ++i) line += " " + shell_word(run.words[i]);
    const std::string directory = run.directory.string();
    text += fmt::format("{} > {} 2>&1\n", line, shell_word(directory + ".log"));
  }
  return text;
}

std::string script_of(const fs::path& directory, std::size_t elements, std::size_t runs, std::size_t runs_each) {
  return fmt::format(
      "#!/bin/bash\n"
      "#SBATCH --job-name=kilotwin-sweep\n"
      "#SBATCH --ntasks=1\n"
      "#SBATCH --cpus-per-task=1\n"
      "#SBATCH --array=0-{}\n"
      "#SBATCH --output=/dev/null\n"
      "# A line of {} per run, {} to an element.\n"
      "status=0\n"
      "for ((i = 1 + SLURM_ARRAY_TASK_ID * {}; i <= (SLURM_ARRAY_TASK_ID + 1) * {} && i <= {}; ++i)); do\n"
      "  eval \"$(sed -n \"${{i}}p\" {})\" || status=1\n"
      "done\n"
      "exit $status\n",
      elements - 1, (directory / "commands").string(), runs_each, runs_each, runs_each, runs,
      shell_word((directory / "commands").string()));
}

std::string last_line_of(const fs::path& log) {
  std::string text = os::read_if_there(log).value_or("");
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

fs::path job_file(const fs::path& directory) { return directory / "slurm-job"; }

/// Whether a job has elements that wait or run.
class JobWatch {
 public:
  JobWatch(fs::path squeue, std::string job) : squeue_(std::move(squeue)), job_(std::move(job)) {}

  /// Nothing: squeue fails. Throws RunError where it has failed for kSlurmPatience.
  [[nodiscard]] std::optional<bool> in_queue() {
    const os::ProcessResult result = os::run_process({squeue_.string(), "--noheader", "--jobs", job_});
    // Slurm forgets a job some time after its end.
    if (!result.end.well() && result.errors.find("Invalid job id") != std::string::npos) return false;
    if (result.end.well()) {
      answered_ = Clock::now();
      said_ = false;
      return !result.output.empty();
    }
    if (Clock::now() > answered_ + kSlurmPatience)
      throw RunError(
          fmt::format("squeue has failed for {} minutes: {}; job {} goes on; once it has ended, --resume "
                      "merges its runs",
                      kSlurmPatience.count(), first_line(result.errors), job_));
    if (!said_) say(fmt::format("kilotwin: squeue fails: {}; asking again", first_line(result.errors)));
    said_ = true;
    return std::nullopt;
  }

 private:
  using Clock = std::chrono::steady_clock;
  const fs::path squeue_;
  const std::string job_;
  Clock::time_point answered_ = Clock::now();
  bool said_ = false;
};

/// Submits the array of runs and returns the job's id. Throws RunError.
std::string submit(const std::vector<SweepRun>& runs, const fs::path& directory, const SlurmOptions& options) {
  const fs::path sbatch = required_tool("sbatch");
  const std::size_t runs_each = (runs.size() + kMostElements - 1) / kMostElements;
  const std::size_t elements = (runs.size() + runs_each - 1) / runs_each;
  os::write_file(directory / "commands", commands_of(runs, options.program));
  const fs::path script = directory / "array.sbatch";
  os::write_file(script, script_of(directory, elements, runs.size(), runs_each));
  std::vector<std::string> words{sbatch.string(), "--parsable", "--chdir=" + fs::current_path().string()};
  words.insert(words.end(), options.for_sbatch.begin(), options.for_sbatch.end());
  words.push_back(script.string());
  const os::ProcessResult submitted = os::run_process(words);
  if (!submitted.end.well()) throw RunError("--slurm: sbatch refused the job: " + first_line(submitted.errors));
  std::string job = first_line(submitted.output.substr(0, submitted.output.find(';')));
  os::write_file(job_file(directory), job + "\n");
  say(fmt::format("kilotwin: job {} of Slurm, {} runs in {} elements", job, runs.size(), elements));
  return job;
}

}  // namespace

void require_no_job(const fs::path& directory) {
  const auto text = os::read_if_there(job_file(directory));
  if (!text) return;
  const std::string job = first_line(*text);
  const fs::path squeue = os::find_executable("squeue");
  if (squeue.empty())
    throw UserError(fmt::format(
        "--resume: job {} of Slurm may still write to {}, and there is no squeue on this machine to ask; "
        "resume where it is, or remove {} if the job has ended",
        job, directory.string(), job_file(directory).string()));
  JobWatch watch(squeue, job);
  std::optional<bool> queued = watch.in_queue();
  for (; !queued; queued = watch.in_queue()) std::this_thread::sleep_for(kQueuePoll);
  if (*queued)
    throw UserError(
        fmt::format("--resume: job {} of Slurm is still in the queue and does these runs; wait for its end, or end "
                    "it by scancel {}",
                    job, job));
  fs::remove(job_file(directory));
}

bool run_on_slurm(std::vector<SweepRun>& runs, const fs::path& directory, const SlurmOptions& options,
                  const std::function<void(const SweepRun&)>& ended) {
  if (runs.empty()) return true;
  const fs::path squeue = required_tool("squeue"), scancel = required_tool("scancel");
  const std::string job = submit(runs, directory, options);

  Progress progress(true);
  for (JobWatch watch(squeue, job); watch.in_queue().value_or(true);) {
    if (interrupted() != 0) {
      static_cast<void>(os::run_process({scancel.string(), job}));
      return false;
    }
    if (progress.due()) {
      const auto done = static_cast<std::size_t>(std::count_if(runs.begin(), runs.end(), [](const SweepRun& run) {
        return fs::exists(run.directory / "summary.json");
      }));
      progress.show(static_cast<double>(done) / static_cast<double>(runs.size()),
                    fmt::format("{} of {} runs done by Slurm", done, runs.size()));
    }
    std::this_thread::sleep_for(kQueuePoll);
  }
  progress.clear();
  fs::remove(job_file(directory));
  for (SweepRun& run : runs) {
    run.well = is_complete(run);
    if (!run.well) {
      run.last_line = last_line_of(run.directory.string() + ".log");
      if (run.last_line.empty()) run.last_line = "its element did not come to its end; --resume does it again";
    }
    ended(run);
  }
  return true;
}

}  // namespace kilotwin::cli

#include "clients/cli/run_command.hpp"

#include <fmt/format.h>
#include <sys/wait.h>

#include "services/behaviours/program_set.hpp"
#include "clients/cli/launcher.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/recovery.hpp"
#include "clients/cli/run_recorder.hpp"
#include "clients/cli/worker.hpp"
#include "clients/local/local_run.hpp"
#include "core/base/error.hpp"
#include "core/dds/dds.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

/// As a shell takes it for one word.
std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+,:=@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

std::string prepared_text(const RunPlan& plan, const recorder::RunDirectory& directory) {
  std::string text =
      fmt::format("prepared {}; start these, on any machine that has this directory, with the same --domain:\n",
                  directory.path().string());
  const std::string run = quoted(directory.path().string());
  for (std::uint32_t p = 0; p < plan.grid.size(); ++p) {
    text += fmt::format("  kilotwin service physics --run {} --partition {},{}\n", run, p % plan.grid.columns(),
                        p / plan.grid.columns());
  }
  text += fmt::format("  kilotwin service comm --run {}\n", run);
  for (std::uint32_t h = 0; h < plan.hosts; ++h) {
    text += fmt::format("  kilotwin service behaviours --run {} --share {}/{}\n", run, h + 1, plan.hosts);
  }
  text += fmt::format("  kilotwin service station --run {}\n", run);
  return text;
}

void run_in_this_process(const RunPlan& plan, const recorder::RunDirectory& directory, std::uint32_t threads,
                         bool quiet, double started_s) {
  local::LocalOptions options;
  options.threads = threads;
  options.run_directory = directory.path();
  Beginning beginning = beginning_of(plan, directory);
  options.resumed = std::move(beginning.resumed);
  options.inputs = std::move(beginning.inputs);
  const auto programs = behaviours::ProgramSet::load(plan.manifest, directory.path());
  ProgressBar progress(plan, !quiet);
  RunRecorder run_recorder(plan, directory, options.resumed, [&](const RunProgress& now) { progress.show(now); });
  const RunTotals totals = local::run(plan, programs, options, run_recorder);
  progress.clear();
  const double first_tick_s =
      std::chrono::duration<double>(run_recorder.first_tick_at().time_since_epoch()).count();
  run_recorder.finish(totals, first_tick_s - started_s);
  if (!totals.failure.empty()) {
    throw RunError(fmt::format("{}; what was recorded so far is in {}", totals.failure, directory.path().string()));
  }
}

/// Returns in the process where the run came to its end, with nothing, and in the one that waited for that, with the exit
/// status.
std::optional<int> run_locally(proto::Manifest manifest, const recorder::RunDirectory& directory,
                               const RunArguments& arguments, double started_s) {
  std::uint32_t threads = std::max(1u, arguments.threads);
  for (;;) {
    const RunPlan plan(manifest);
    const std::optional<int> status = status_of_worker();
    if (!status) {
      run_in_this_process(plan, directory, threads, arguments.quiet, started_s);
      forget_attempts(directory);
      return std::nullopt;
    }
    if (WIFEXITED(*status)) return WEXITSTATUS(*status);  // it has said what there was to say
    std::vector<behaviours::Culprit> running;
    for (std::uint32_t h = 0; h < plan.hosts; ++h) {
      if (const auto culprit = behaviours::take_note(directory.path(), HostId{h})) running.push_back(*culprit);
    }
    if (!brought_itself_down(*status) || running.empty()) {
      throw RunError(fmt::format("the run was ended by signal {}; what was recorded so far is in {}",
                                 WTERMSIG(*status), directory.path().string()));
    }
    recover(directory, manifest, running);
    if (running.size() > 1) threads = 1;
  }
}

}  // namespace

int run_command(const RunArguments& arguments, double start_monotonic_s) {
  // The domain is claimed before anything is written, so that one in use leaves nothing behind.
  std::optional<dds::DomainClaim> claim;
  if (arguments.mode == "federated" && !arguments.prepare) {
    claim.emplace(arguments.domain ? dds::DomainClaim::exactly(*arguments.domain) : dds::DomainClaim::any());
  }
  const Prepared prepared = prepare(arguments);
  const RunPlan plan(prepared.manifest);
  if (arguments.prepare) {
    fmt::print("{}", prepared_text(plan, prepared.directory));
    return 0;
  }
  catch_interrupts();
  if (arguments.mode == "local") {
    if (const auto status = run_locally(prepared.manifest, prepared.directory, arguments, start_monotonic_s))
      return *status;
  } else {
    const int status = launch(plan, prepared.directory, {claim->domain(), start_monotonic_s, !arguments.quiet});
    if (status != 0) return status;
  }
  if (!arguments.quiet) {
    fmt::print("{}", recorder::summary_text(recorder::read_summary(prepared.directory.summary()),
                                            prepared.directory.path()));
  }
  return 0;
}

}  // namespace kilotwin::cli

// `kilotwin run`: runs an experiment from its file to its summary.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/launcher.hpp"
#include "clients/cli/local_worker.hpp"
#include "clients/cli/other_program.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/recovery.hpp"
#include "clients/cli/run_arguments.hpp"
#include "clients/cli/run_report.hpp"
#include "clients/cli/shell_words.hpp"
#include "clients/cli/worker.hpp"
#include "clients/recorder/summary.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/dds/dds.hpp"
#include "core/os/children.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::cli {
namespace {

std::string prepared_text(const RunPlan& plan, const recorder::RunDirectory& directory,
                          const MonitorOptions& monitor) {
  std::string text = fmt::format(
      "prepared {}; start these services with the same --domain N, on several machines also with --peer ADDRESS of "
      "each:\n",
      directory.path().string());
  const std::string run = shell_word(directory.path().string());
  for (std::uint32_t p = 0; p < plan.grid.size(); ++p) {
    text += fmt::format("  kilotwin service physics --run {} --partition {},{}\n", run, p % plan.grid.columns(),
                        p / plan.grid.columns());
  }
  text += fmt::format("  kilotwin service radio --run {}\n", run);
  for (std::uint32_t h = 0; h < plan.hosts; ++h) {
    text += fmt::format("  kilotwin service behaviours --run {} --share {}/{}\n", run, h + 1, plan.hosts);
  }
  text += fmt::format("  kilotwin service station --run {}", run);
  for (const std::string& word : monitor_words(monitor)) text += " " + shell_word(word);
  text += "\n";
  return text;
}

/// Returns in two processes: nothing in the worker, which has done the run; the exit status in the process that waited for it.
std::optional<int> run_locally(proto::Manifest manifest, const recorder::RunDirectory& directory,
                               const RunArguments& arguments, double started_s) {
  std::uint32_t threads = std::max(1u, arguments.threads);
  for (;;) {
    const RunPlan plan(manifest);
    const std::optional<os::ProcessEnd> end = end_of_worker();
    if (!end) {
      run_in_this_process(plan, directory, threads, arguments.quiet, started_s);
      forget_attempts(directory);
      return std::nullopt;
    }
    // Where system calls cannot be refused (services/behaviours/faults.hpp), a robot's program may end the worker with status 0 and
    // without a result. With any other status the worker has reported its error.
    const bool no_result = end->well() && !std::filesystem::exists(directory.summary());
    if (end->signal == 0 && !no_result) return end->code;
    std::vector<behaviours::Culprit> running;
    for (std::uint32_t h = 0; h < plan.hosts; ++h) {
      if (const auto culprit = behaviours::take_note(directory.path(), HostId{h})) running.push_back(*culprit);
    }
    if (no_result && running.empty()) {
      throw RunError(fmt::format("the run ended without a result; what was recorded so far is in {}",
                                 directory.path().string()));
    }
    if (!no_result && (!os::crashed(*end) || running.empty())) {
      throw RunError(fmt::format("the run {}; what was recorded so far is in {}", os::in_words(*end),
                                 directory.path().string()));
    }
    recover(directory, manifest, running);
    if (running.size() > 1) threads = 1;
  }
}

/// Throws UserError, and removes the run directory, if the monitor would have nothing to watch.
void require_watchable(const RunPlan& plan, const recorder::RunDirectory& directory,
                       const MonitorOptions& options) {
  try {
    const RunMonitor monitor(plan, options, {});
  } catch (const UserError&) {
    std::error_code ignored;
    std::filesystem::remove_all(directory.path(), ignored);
    throw;
  }
}

/// The web page of the run: live, then recorded.
os::Process start_view(const recorder::RunDirectory& directory, std::uint32_t domain) {
  os::Command command;
  command.arguments = {"kilotwin", "view", directory.path().string(), "--domain", std::to_string(domain)};
  command.program = program_beside("kilotwin-view");
  command.at_death = SIGTERM;
  return os::Process(command);
}

void view_until_interrupted(os::Process& page) {
  std::fflush(stdout);  // the summary comes first, in a pipe too
  say("kilotwin: the page now shows the recording; Ctrl-C ends it");
  while (interrupted() == 0 && !page.poll()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  page.signal(SIGTERM);
  page.wait();
}

struct RunOptions : RunArguments {
  bool view = false;  ///< with a web page
};

int run(RunOptions arguments, double started_s) {
  arguments.record_for_page = arguments.view;
  if (arguments.mode == "local") warn_beyond_cores("--threads", arguments.threads);
  if (arguments.mode == "local" && arguments.domain)
    throw UserError("--domain: a local run uses no DDS domain; leave the option out, or give --mode federated");
  if (arguments.mode == "local" && arguments.view)
    throw UserError(
        "--view: shows federated runs; give --mode federated, or `kilotwin view RUN` once the run has begun");
  if (arguments.prepare && arguments.view)
    throw UserError("--view: --prepare starts no run; leave one of them out");
  if (arguments.monitor.on && arguments.mode == "local") {
    throw UserError(
        "--monitor: a local run hears no tracker; leave --mode local out, or give --monitor to `kilotwin replay`");
  }
  check_monitor_options(arguments.monitor);
  // Claim the domain before the first file is written, so that a refused run leaves no files.
  std::optional<dds::DomainClaim> claim;
  if (arguments.mode == "federated" && !arguments.prepare) {
    claim.emplace(arguments.domain ? dds::DomainClaim::exactly(*arguments.domain) : dds::DomainClaim::any());
  }
  const Prepared prepared = prepare(arguments);
  const RunPlan plan(prepared.manifest);
  if (arguments.monitor.on) require_watchable(plan, prepared.directory, arguments.monitor);
  if (arguments.prepare) {
    fmt::print("{}", prepared_text(plan, prepared.directory, arguments.monitor));
    return kDone;
  }
  catch_interrupts();
  std::optional<os::Process> page;
  if (arguments.view) page.emplace(start_view(prepared.directory, claim->domain()));
  if (claim && !arguments.quiet)
    say(fmt::format("kilotwin: runs on DDS domain {}; kilotwin control status --domain {} says how it goes",
                    claim->domain(), claim->domain()));
  if (arguments.mode == "local") {
    if (const auto status = run_locally(prepared.manifest, prepared.directory, arguments, started_s))
      return *status;
  } else {
    const int status = launch(plan, prepared.directory,
                              {claim->domain(), started_s, arguments.give_up_after_s, !arguments.quiet,
                               arguments.realtime, monitor_words(arguments.monitor)});
    if (status != 0) {
      if (!arguments.quiet) write_run_report(prepared.directory);
      return status;
    }
  }
  if (!arguments.quiet) write_run_report(prepared.directory);
  if (!arguments.quiet || arguments.strict) {
    const recorder::Summary summary = recorder::read_summary(prepared.directory.summary());
    const std::string place = place_in_words(prepared.directory.path(), arguments.output,
                                             recorder::RunDirectory::default_path(summary.name, summary.seed));
    if (!arguments.quiet) fmt::print("{}", recorder::summary_text(summary, place));
    if (arguments.strict && summary.robots_failed > 0) {
      throw RunError(fmt::format(
          "{} of {} robots failed, and --strict was given; \"failures\" of {} says who, when and "
          "where",
          summary.robots_failed, summary.robots + summary.cells, prepared.directory.summary().string()));
    }
  }
  if (page) view_until_interrupted(*page);
  return kDone;
}

}  // namespace

Command add_run(CLI::App& program, double started_s) {
  const auto arguments = std::make_shared<RunOptions>();
  CLI::App& app = *program.add_subcommand("run", "run an experiment to its end");
  add_experiment_options(app, *arguments);
  app.add_option("--mode", arguments->mode, "federated: services as processes over DDS; local: all in one process")
      ->check(CLI::IsMember({"local", "federated"}).description(""))
      ->capture_default_str()
      ->type_name("MODE");
  app.add_option("--partitions", arguments->partitions, "columns and rows of physics partitions, such as 2x1")
      ->type_name("CxR");
  app.add_option("--hosts", arguments->hosts, "behaviours hosts; each runs the programs of a share of the robots")
      ->type_name("N");
  app.add_option("--threads", arguments->threads, "threads of a local run")
      ->check(CLI::Range(1, 256).description(""))
      ->capture_default_str()
      ->type_name("N");
  add_change_options(app, *arguments);
  app.add_option("--pace", arguments->pace, "max, or simulated time over wall time: 1 is real time")
      ->capture_default_str()
      ->type_name("FACTOR");
  app.add_option("--max-lateness", arguments->max_lateness_ms,
                 "with --pace: end the run with status 1 when a tick begins so much behind the pace; 0: never")
      ->check(CLI::NonNegativeNumber.description(""))
      ->capture_default_str()
      ->type_name("MS");
  app.add_flag("--realtime", arguments->realtime,
               "services take precedence over other programs of the machine, where the system allows it");
  app.add_option("--checkpoint-every", arguments->checkpoint_every_s, "simulated time between checkpoints, s")
      ->type_name("SECONDS");
  app.add_option("--resume", arguments->resume, "start from the newest checkpoint of that run")->type_name("RUN");
  app.add_flag("--prepare", arguments->prepare,
               "write the run directory, print the commands that start the services by hand, and stop");
  app.add_option("--domain", arguments->domain, "DDS domain (default: a free one)")->type_name("N");
  app.footer("Example: kilotwin run experiments/disperse.txtpb --seed 2 --out here");
  app.add_option("--give-up-after", arguments->give_up_after_s,
                 "end the run after services have waited so long for each other without progress; 0: never")
      ->check(CLI::NonNegativeNumber.description(""))
      ->capture_default_str()
      ->type_name("SECONDS");
  add_monitor_options(app, arguments->monitor);
  add_output_options(app, arguments->output, "runs/NAME-SEED, with a number added if it exists");
  app.add_flag("--strict", arguments->strict, "end with status 1 where a robot's program has failed");
  app.add_flag("--quiet", arguments->quiet, "no progress and no summary on the screen");
  app.add_flag(
      "--view", arguments->view,
      "a web page of the run, live and then recorded, until Ctrl-C; its address is printed; up to 1000 robots, "
      "messages, counters of the radio and variables are recorded for it");
  return {&app, [arguments, started_s] { return run(*arguments, started_s); }};
}

}  // namespace kilotwin::cli

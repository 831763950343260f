// `kilotwin sweep`: many local runs on all cores, a table and curves with standard errors, and plots.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/run_arguments.hpp"
#include "clients/cli/sweep_points.hpp"
#include "clients/cli/sweep_report.hpp"
#include "clients/cli/sweep_runs.hpp"
#include "clients/recorder/provenance.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

struct SweepArguments {
  RunArguments run;              ///< arguments of all runs; its output is that of the sweep
  std::string seeds;             ///< "A..B", or one number; empty: the seed of the experiment
  std::vector<std::string> set;  ///< FIELD=V1,V2,... or FIELD=A..B: one run per value, all combinations
  /// The observable in the plots: clients/recorder/observables.hpp. Empty: pushed if there are movable bodies, else msd.
  std::string plot;
  std::uint32_t jobs = 0;  ///< runs at a time; 0: one per core
};

/// Failed runs that are reported one by one; the others are counted.
constexpr std::size_t kMostComplaints = 5;

recorder::Observable observable_of(const std::string& name) {
  std::string names;
  for (std::size_t o = 0; o < recorder::kObservables.size(); ++o) {
    if (recorder::kObservables[o].name == name) return static_cast<recorder::Observable>(o);
    names += fmt::format("{}{}", o == 0 ? "" : ", ", recorder::kObservables[o].name);
  }
  throw UserError(fmt::format("--plot: no observable \"{}\"; there are {}", name, names));
}

std::vector<std::string> words_of(const SweepArguments& arguments, const SweepPoint& point, const SweepRun& run) {
  std::vector<std::string> words{"kilotwin",
                                 "run",
                                 arguments.run.experiment.string(),
                                 "--mode",
                                 "local",
                                 "--quiet",
                                 "--out",
                                 run.directory.string()};
  if (!arguments.seeds.empty()) words.insert(words.end(), {"--seed", std::to_string(run.seed)});
  for (const std::string& set : point) words.insert(words.end(), {"--set", set});
  for (const std::string& define : arguments.run.define) words.insert(words.end(), {"--define", define});
  if (arguments.run.duration_s)
    words.insert(words.end(), {"--duration", fmt::format("{}", *arguments.run.duration_s)});
  if (arguments.run.robots) words.insert(words.end(), {"--robots", std::to_string(*arguments.run.robots)});
  if (!arguments.run.behaviour.empty())
    words.insert(words.end(), {"--behaviour", arguments.run.behaviour.string()});
  if (!arguments.run.model.empty()) words.insert(words.end(), {"--model", arguments.run.model.string()});
  return words;
}

int sweep(const SweepArguments& arguments) {
  const std::uint32_t cores = std::max(1u, std::thread::hardware_concurrency());
  warn_beyond_cores("--jobs", arguments.jobs);
  const std::vector<SweepPoint> points = sweep_points(arguments.set);
  recorder::Observable plotted = recorder::Observable::kMsd;
  if (!arguments.plot.empty()) plotted = observable_of(arguments.plot);
  std::vector<std::uint64_t> seeds;
  if (!arguments.seeds.empty()) seeds = parse_seeds(arguments.seeds);
  if (points.size() * std::max<std::size_t>(1, seeds.size()) > kMostSweepRuns)
    throw UserError(
        fmt::format("{} points with {} seeds are more than {} runs", points.size(), seeds.size(), kMostSweepRuns));
  // Check every point before the first run starts.
  std::string name;
  std::vector<std::uint64_t> own_seeds;
  for (const SweepPoint& point : points) {
    RunArguments one = arguments.run;
    one.set = point;
    const LoadedExperiment loaded = load_with_overrides(one);
    static_cast<void>(resolve(loaded, one, Notes::kSilent));
    name = loaded.experiment.name();
    if (arguments.plot.empty() && loaded.experiment.movable_size() > 0) plotted = recorder::Observable::kPushed;
    own_seeds.push_back(loaded.experiment.seed());
  }
  const fs::path fallback = fs::path("runs") / (name + "-sweep");
  const fs::path directory = make_plain_output(
      arguments.run.output, fallback, {arguments.run.experiment, arguments.run.model, arguments.run.behaviour});
  std::vector<SweepRun> runs;
  for (std::size_t point = 0; point < points.size(); ++point) {
    for (const std::uint64_t seed : seeds.empty() ? std::vector{own_seeds[point]} : seeds) {
      SweepRun& run = runs.emplace_back();
      run.point = point;
      run.seed = seed;
      run.directory = directory / fmt::format("{:04}-{}", point, seed);
      run.words = words_of(arguments, points[point], run);
    }
  }

  SweepReport report(name, points, plotted);
  std::size_t failed = 0;
  const auto complain = [&](const SweepRun& run, const std::string& why) {
    if (++failed > kMostComplaints) return;
    const SweepPoint& point = points[run.point];
    say(fmt::format("kilotwin: {} with seed {} failed: {}", point.empty() ? name : label(point), run.seed, why));
  };
  catch_interrupts();
  const bool all = run_all(runs, arguments.jobs > 0 ? arguments.jobs : cores, [&](const SweepRun& run) {
    if (!run.well)
      return complain(run, run.last_line.empty() ? "it printed nothing; is the disk full?" : run.last_line);
    try {
      report.add(run.point, run.directory);
    } catch (const std::exception& error) {
      complain(run, error.what());
    }
  });
  if (failed > kMostComplaints) say(fmt::format("kilotwin: and {} more runs failed", failed - kMostComplaints));
  if (!all) say(fmt::format("kilotwin: interrupted; {} of {} runs were done", report.runs(), runs.size()));
  if (report.runs() == 0) return 1;

  report.write(directory, recorder::provenance_of_this_process());
  std::string plots = (directory / "sweep.svg").string();
  if (report.has_response()) plots += " and " + (directory / "response.svg").string();
  fmt::print("{}table   {}\ncurves  {}\nplot    {}\nreport  {}\nresults {}\n", report.table(),
             (directory / "sweep.csv").string(), (directory / "curves.csv").string(), plots,
             (directory / "report.html").string(), place_in_words(directory, arguments.run.output, fallback));
  return failed == 0 && all ? kDone : kFailed;
}

}  // namespace

Command add_sweep(CLI::App& program) {
  const auto arguments = std::make_shared<SweepArguments>();
  CLI::App& app =
      *program.add_subcommand("sweep", "run many variants on all cores; write a table, curves and plots");
  add_experiment_options(app, arguments->run);
  app.add_option("--seeds", arguments->seeds, "every variant runs with each of these seeds")->type_name("A..B");
  app.add_option("--set", arguments->set,
                 "V1,V2,... or A..B: the values of a field; several --set give all combinations")
      ->allow_extra_args(false)
      ->type_name("FIELD=VALUES");
  app.add_option("--plot", arguments->plot,
                 "what the plots show: msd, displacement, spread, nearest, polarisation or pushed (default: pushed "
                 "where there are movable bodies, else msd)")
      ->type_name("OBSERVABLE");
  app.add_option("--jobs", arguments->jobs, "runs at a time (default: one per core)")->type_name("N");
  add_output_options(app, arguments->run.output, "runs/NAME-sweep, with a number added if it exists");
  app.footer("Example: kilotwin sweep experiments/disperse.txtpb --seeds 1..20 --set motion.noise=true,false");
  return {&app, [arguments] { return sweep(*arguments); }};
}

}  // namespace kilotwin::cli

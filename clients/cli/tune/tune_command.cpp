// `kilotwin-tune tune`: values of fields and macros that make an observable largest or smallest.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "clients/cli/commands.hpp"
#include "clients/cli/model_files.hpp"
#include "clients/cli/observable_choice.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/progress.hpp"
#include "clients/cli/sweep_runs.hpp"
#include "clients/cli/tune/measurement.hpp"
#include "clients/cli/tune/tune_report.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

struct TuneArguments {
  RunArguments run;
  std::vector<std::string> vary, vary_define;
  std::string maximise, minimise;
  std::size_t seeds = 4, budget = 400;
  std::uint64_t seed = 1;
  std::vector<fs::path> models;
  bool worst = false;
  std::uint32_t jobs = 0;
  bool quiet = false;
};

std::vector<tune::Parameter> parameters_of(const TuneArguments& arguments) {
  std::vector<tune::Parameter> parameters;
  for (const std::string& text : arguments.vary) parameters.push_back(tune::parse_parameter(text, "--vary", false));
  for (const std::string& text : arguments.vary_define)
    parameters.push_back(tune::parse_parameter(text, "--vary-define", true));
  if (parameters.empty()) throw UserError("nothing to vary; give --vary FIELD=A..B or --vary-define MACRO=A..B");
  return parameters;
}

Goal goal_of(const TuneArguments& arguments) {
  if (arguments.maximise.empty() == arguments.minimise.empty())
    throw UserError("give the observable by --maximise or by --minimise");
  Goal goal;
  goal.largest = arguments.minimise.empty();
  goal.observable = goal.largest ? arguments.maximise : arguments.minimise;
  goal.models = arguments.models;
  goal.over_models = arguments.worst ? OverModels::kWorst : OverModels::kMean;
  return goal;
}

/// Checks the experiment in the middle and at the corners of the ranges, before the first run.
std::string checked_name(const Measurement& measurement, const Goal& goal, std::size_t parameters) {
  std::string name;
  for (const double place : {0.5, 0.0, 1.0}) {
    RunArguments one = measurement.arguments_at(tune::Point(parameters, place));
    const LoadedExperiment loaded = load_with_overrides(one);
    check_observable(goal.largest ? "--maximise" : "--minimise", goal.observable, loaded.experiment);
    for (const fs::path& model : goal.models) {
      one.model = model;
      static_cast<void>(resolve(load_with_overrides(one), one, Notes::kSilent));
    }
    if (goal.models.empty()) static_cast<void>(resolve(loaded, one, Notes::kSilent));
    name = loaded.experiment.name();
  }
  return name;
}

int tune_experiment(TuneArguments arguments) {
  arguments.models = model_files("--models", arguments.models);
  const std::uint32_t cores = os::cores();
  warn_beyond_cores("--jobs", arguments.jobs);
  TuneResult result;
  result.parameters = parameters_of(arguments);
  result.goal = goal_of(arguments);
  result.seeds = arguments.seeds;
  const std::size_t models = std::max<std::size_t>(1, arguments.models.size());

  tune::Settings settings;
  settings.parameters = result.parameters.size();
  settings.seeds = arguments.seeds;
  settings.seed = arguments.seed;
  // The last measurement covers the present values too.
  const std::size_t last = tune::last_seeds(settings).count;
  settings.budget = arguments.budget / models > last ? arguments.budget / models - last : 0;
  if (settings.budget < tune::least_budget(settings))
    throw UserError(fmt::format("--budget {}: {} parameters with {} seeds{} need at least {} runs",
                                arguments.budget, settings.parameters, arguments.seeds,
                                models > 1 ? fmt::format(" and {} models", models) : "",
                                (tune::least_budget(settings) + last) * models));
  Progress progress(!arguments.quiet);
  std::size_t runs = 0;
  const auto ran = [&](std::size_t more) {
    runs += more;
    progress.show(static_cast<double>(runs) / static_cast<double>(arguments.budget), fmt::format("{} runs", runs));
  };
  const fs::path fallback = fs::path("runs") / "tune";
  // The check needs no directory; without it, an error would leave an empty one.
  result.name = checked_name(Measurement(arguments.run, result.parameters, result.goal, {}, 1, ran), result.goal,
                             settings.parameters);
  const fs::path directory = make_plain_output(
      arguments.run.output, fallback, {arguments.run.experiment, arguments.run.model, arguments.run.behaviour});
  const fs::path scratch = directory / "runs";
  fs::create_directory(scratch);
  Measurement measurement(arguments.run, result.parameters, result.goal, scratch,
                          arguments.jobs > 0 ? arguments.jobs : cores, ran);
  catch_interrupts();
  settings.stop = [&] { return measurement.interrupted() || interrupted() != 0; };
  try {
    result.tuned = tune::tune([&](const tune::Point& point, std::uint64_t first,
                                  std::size_t count) { return measurement.of(point, first, count); },
                              settings);
  } catch (const tune::FailedSearch&) {
    fs::remove_all(scratch);
    throw RunError("no run of the first points succeeded: " + measurement.last_failure());
  }
  const tune::Seeds check = tune::last_seeds(settings);
  if (!result.tuned.stopped && !settings.stop()) {
    const std::vector<double> present = measurement.of_present(check.first, check.count);
    result.present = tune::estimate(present);
    result.gain = tune::difference(result.tuned.last, present);
  }
  progress.clear();
  fs::remove_all(scratch);
  if (result.tuned.stopped || settings.stop()) {
    say(fmt::format("kilotwin: interrupted after {} runs; nothing was written", runs));
    return kFailed;
  }
  const RunArguments best = measurement.arguments_at(result.tuned.best);
  result.run_words = run_words(best, best.set, std::nullopt, fs::path("runs") / (result.name + "-tuned"));
  write_tune_report(result, directory, recorder::provenance_of_this_process());
  for (std::size_t i = 0; i < result.parameters.size(); ++i)
    fmt::print("{}\n", setting_at(result.parameters[i], result.tuned.best[i]));
  fmt::print("{}\npoints  {}\nresult  {}\nplot    {}\nreport  {}\nresults {}\n", in_words(result),
             (directory / "points.csv").string(), (directory / "tune.json").string(),
             (directory / "search.svg").string(), (directory / "report.html").string(),
             place_in_words(directory, arguments.run.output, fallback));
  const std::size_t failed = measurement.runs_with_failed_robots();
  if (failed > 0)
    say(fmt::format("kilotwin: robots failed in {} of {} runs; {}", failed, runs,
                    arguments.run.strict ? "--strict left them out of the means"
                                         : "--strict leaves such runs out of the means"));
  return failed > 0 && arguments.run.strict ? kFailed : kDone;
}

}  // namespace

Command add_tune(CLI::App& program) {
  const auto arguments = std::make_shared<TuneArguments>();
  CLI::App& app = *program.add_subcommand(
      "tune", "find values of a program or an experiment that make an observable best, by CMA-ES");
  add_experiment_options(app, arguments->run);
  app.add_option("--set", arguments->run.set, "sets a field of the experiment in all runs")
      ->allow_extra_args(false)
      ->type_name("FIELD=VALUE");
  app.add_option("--vary", arguments->vary,
                 "a field and its range; between whole numbers it takes whole ones; log: counts ratios alike")
      ->allow_extra_args(false)
      ->type_name("FIELD=[log:]A..B");
  app.add_option("--vary-define", arguments->vary_define, "a macro of the programs and its range")
      ->allow_extra_args(false)
      ->type_name("MACRO=[log:]A..B");
  app.add_option("--maximise", arguments->maximise, "the observable, at the end of the runs, that is to be largest")
      ->type_name("OBSERVABLE");
  app.add_option("--minimise", arguments->minimise, "the same, to be smallest")->type_name("OBSERVABLE");
  app.add_option("--seeds", arguments->seeds, "runs of each point of the search, with different seeds")
      ->check(CLI::Range(std::size_t{2}, std::size_t{1000}).description(""))
      ->capture_default_str()
      ->type_name("N");
  app.add_option("--budget", arguments->budget, "runs of search and check together")
      ->capture_default_str()
      ->type_name("RUNS");
  app.add_option("--seed", arguments->seed, "first seed of the runs, and the seed of the search")
      ->capture_default_str()
      ->type_name("N");
  CLI::Option* const models =
      app.add_option(
             "--models", arguments->models,
             "model files, or directories of them; each point runs with all, so that the best survives what is "
             "uncertain")
          ->type_name("DIR|FILE...");
  models->excludes(app.get_option("--model"));
  app.add_flag("--worst", arguments->worst, "of several models, the worst counts and not the mean")->needs(models);
  add_strict_option(app, arguments->run);
  app.add_option("--jobs", arguments->jobs, "runs at a time (default: one per core)")->type_name("N");
  app.add_flag("--quiet", arguments->quiet, "no progress");
  add_output_options(app, arguments->run.output, "runs/tune, with a number added if it exists");
  app.footer(
      "Example: kilotwin tune experiments/disperse.txtpb --vary robots[0].layout.grid.pitch_mm=40..100 --maximise "
      "spread");
  return {&app, [arguments] { return tune_experiment(*arguments); }};
}

}  // namespace kilotwin::cli

// `kilotwin sweep`: many local runs on all cores, a table and curves with standard errors, and plots.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/model_files.hpp"
#include "clients/cli/observable_choice.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/run_arguments.hpp"
#include "clients/cli/sweep_designs.hpp"
#include "clients/cli/sweep_points.hpp"
#include "clients/cli/sweep_report.hpp"
#include "clients/cli/sweep_runs.hpp"
#include "clients/cli/sweep_slurm.hpp"
#include "clients/cli/sweep_state.hpp"
#include "clients/recorder/provenance.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

struct SweepArguments {
  RunArguments run;              ///< arguments of all runs; its output is that of the sweep
  std::string seeds;             ///< "A..B", or one number; empty: the seed of the experiment
  std::vector<std::string> set;  ///< FIELD=VALUES, sweep_points.hpp: all combinations
  std::size_t latin = 0;         ///< points of a Latin hypercube over the ranges in `set`; 0: all combinations
  std::uint64_t latin_seed = 1;
  /// The observable in the plots: clients/recorder/observables.hpp, or one of the experiment. Empty: pushed if there are movable bodies,
  /// else msd.
  std::string plot;
  std::vector<fs::path> models;  ///< files and directories of models, each of which runs with every point
  std::string goal = "largest";  ///< with models: which value of the observable is better
  std::string colour_by, x_axis = "auto", y_axis = "linear";
  std::uint32_t jobs = 0;  ///< runs at a time; 0: one per core
  fs::path resume;         ///< a sweep to go on with
  bool slurm = false;
  SlurmOptions slurm_options;
};

/// Failed runs that are reported one by one; the others are counted.
constexpr std::size_t kMostComplaints = 5;

std::vector<std::string> words_of(const SweepArguments& arguments, const SweepPoint& point, const SweepRun& run) {
  return run_words(arguments.run, point, arguments.seeds.empty() ? std::nullopt : std::optional(run.seed),
                   run.directory);
}

/// The parts of a sweep.
struct Sweep {
  std::string name;
  std::vector<SweepPoint> points;
  std::vector<std::uint64_t> own_seeds;  ///< per point: the seed that the experiment states
  recorder::Observable plotted = recorder::Observable::kMsd;
  SweepContent content;
  fs::path directory, fallback;
  std::vector<SweepRun> runs;
};

/// Checks every point before the first run starts.
Sweep checked(const SweepArguments& arguments) {
  Sweep sweep;
  sweep.points = arguments.latin > 0 ? latin_points(arguments.set, arguments.latin, arguments.latin_seed)
                                     : sweep_points(arguments.set);
  const std::vector<fs::path> models = model_files("--models", arguments.models);
  if (!models.empty()) sweep.points = with_models(sweep.points, models);
  for (const SweepPoint& point : sweep.points) {
    RunArguments one = arguments.run;
    for (const std::string& set : point) {
      if (is_model(set))
        one.model = set.substr(set.find('=') + 1);
      else
        one.set.push_back(set);
    }
    const LoadedExperiment loaded = load_with_overrides(one);
    sweep.content.add(resolve(loaded, one, Notes::kSilent));
    sweep.name = loaded.experiment.name();
    if (!arguments.plot.empty()) check_observable("--plot", arguments.plot, loaded.experiment);
    if (loaded.experiment.movable_size() > 0) sweep.plotted = recorder::Observable::kPushed;
    sweep.own_seeds.push_back(loaded.experiment.seed());
  }
  if (!arguments.run.model.empty()) sweep.content.add_file(arguments.run.model);
  for (const fs::path& model : models) sweep.content.add_file(model);
  if (const auto wanted = built_in_observable(arguments.plot)) sweep.plotted = *wanted;
  if (!arguments.colour_by.empty())
    static_cast<void>(SweepColours(sweep.points, arguments.colour_by, std::nullopt));
  return sweep;
}

void add_runs(const SweepArguments& arguments, Sweep& sweep) {
  std::vector<std::uint64_t> seeds;
  if (!arguments.seeds.empty()) seeds = parse_seeds(arguments.seeds);
  if (sweep.points.size() * std::max<std::size_t>(1, seeds.size()) > kMostSweepRuns)
    throw UserError(fmt::format("{} points with {} seeds are more than {} runs", sweep.points.size(), seeds.size(),
                                kMostSweepRuns));
  for (std::size_t point = 0; point < sweep.points.size(); ++point) {
    for (const std::uint64_t seed : seeds.empty() ? std::vector{sweep.own_seeds[point]} : seeds) {
      SweepRun& run = sweep.runs.emplace_back();
      run.point = point;
      run.seed = seed;
      run.directory = sweep.directory / fmt::format("{:04}-{}", point, seed);
      run.words = words_of(arguments, sweep.points[point], run);
      run.strict = arguments.run.strict;
    }
  }
}

SweepPlots plots_of(const SweepArguments& arguments, const Sweep& sweep) {
  const AxisScale x = arguments.x_axis == "log"      ? AxisScale::kLogarithmic
                      : arguments.x_axis == "linear" ? AxisScale::kLinear
                                                     : AxisScale::kAutomatic;
  SweepPlots plots{sweep.plotted, arguments.plot, arguments.colour_by, x, arguments.y_axis == "log", {}};
  if (!arguments.models.empty()) plots.largest = arguments.goal == "largest";
  return plots;
}

/// The results of a sweep as they come.
class Results {
 public:
  Results(const SweepArguments& arguments, const Sweep& sweep)
      : sweep_(sweep), report_(sweep.name, sweep.points, plots_of(arguments, sweep)) {}
  void take(const SweepRun& run) {
    if (!run.well)
      return complain(run, run.last_line.empty() ? "it printed nothing; is the disk full?" : run.last_line);
    try {
      report_.add(run.point, run.seed, run.directory);
    } catch (const std::exception& error) {
      complain(run, error.what());
    }
  }
  [[nodiscard]] const SweepReport& report() const { return report_; }
  [[nodiscard]] std::size_t failed() const { return failed_; }
  void say_how_many_failed() const {
    if (failed_ > kMostComplaints) say(fmt::format("kilotwin: and {} more runs failed", failed_ - kMostComplaints));
  }

 private:
  void complain(const SweepRun& run, const std::string& why) {
    report_.add_failed(run.point, run.seed, run.directory, why);
    if (++failed_ > kMostComplaints) return;
    const SweepPoint& point = sweep_.points[run.point];
    say(fmt::format("kilotwin: {} with seed {} failed: {}", point.empty() ? sweep_.name : label(point), run.seed,
                    why));
  }

  const Sweep& sweep_;
  SweepReport report_;
  std::size_t failed_ = 0;
};

void print_results(const SweepArguments& arguments, const Sweep& sweep, const SweepReport& report, bool plotted) {
  const fs::path& directory = sweep.directory;
  std::string plots = (directory / "sweep.svg").string();
  if (report.has_response()) plots += " and " + (directory / "response.svg").string();
  fmt::print("{}runs    {}\ntable   {}\ncurves  {}\n", report.table(), (directory / "runs.csv").string(),
             (directory / "sweep.csv").string(), (directory / "curves.csv").string());
  if (!arguments.models.empty()) fmt::print("designs {}\n", (directory / "designs.csv").string());
  if (plotted)
    fmt::print("plot    {}\nreport  {}\n", plots, (directory / "report.html").string());
  else
    fmt::print("plot    none: gnuplot is not installed; scripts/setup installs it\n");
  fmt::print("results {}\n", arguments.resume.empty()
                                 ? place_in_words(directory, arguments.run.output, sweep.fallback)
                                 : directory.string());
}

int sweep(const SweepArguments& arguments) {
  const std::uint32_t cores = os::cores();
  warn_beyond_cores("--jobs", arguments.jobs);
  Sweep sweep = checked(arguments);
  sweep.fallback = fs::path("runs") / (sweep.name + "-sweep");
  const SweepPlan plan{arguments.run.experiment, sweep.points, words_of(arguments, {}, {}), sweep.content};
  if (arguments.resume.empty()) {
    std::vector<fs::path> inputs = arguments.models;
    inputs.insert(inputs.end(), {arguments.run.experiment, arguments.run.model, arguments.run.behaviour});
    sweep.directory = make_plain_output(arguments.run.output, sweep.fallback, inputs);
    add_runs(arguments, sweep);
    write_plan(sweep.directory, plan);
  } else {
    sweep.directory = arguments.resume;
    check_plan(sweep.directory, plan);
    require_no_job(sweep.directory);
    add_runs(arguments, sweep);
  }

  Results results(arguments, sweep);
  std::vector<SweepRun> waiting;
  for (SweepRun& run : sweep.runs) {
    run.well = !arguments.resume.empty() && is_complete(run);
    if (run.well)
      results.take(run);
    else
      waiting.push_back(run);
  }
  if (!arguments.resume.empty())
    say(fmt::format("kilotwin: {} of {} runs were done before", sweep.runs.size() - waiting.size(),
                    sweep.runs.size()));
  for (const SweepRun& run : waiting) remove_unfinished(run);
  catch_interrupts();
  const auto ended = [&](const SweepRun& run) { results.take(run); };
  const bool all = arguments.slurm ? run_on_slurm(waiting, sweep.directory, arguments.slurm_options, ended)
                                   : run_all(waiting, arguments.jobs > 0 ? arguments.jobs : cores, ended);
  results.say_how_many_failed();
  const SweepReport& report = results.report();
  if (!all) {
    say(fmt::format(
        "kilotwin: interrupted; {} of {} runs were done; the same command with --resume {} in place of --out "
        "does the others",
        report.runs(), sweep.runs.size(), sweep.directory.string()));
  }
  if (report.runs() + results.failed() == 0) return kFailed;
  const bool plotted = report.write(sweep.directory, recorder::provenance_of_this_process());
  if (results.failed() > 0)
    say(fmt::format("kilotwin: {}{} lists the runs that failed, and why",
                    report.runs() == 0 ? "no run came to its end; " : "", (sweep.directory / "runs.csv").string()));
  if (report.runs() == 0) return kFailed;
  if (const std::size_t runs = report.runs_with_failed_robots(); runs > 0)
    say(fmt::format(
        "kilotwin: robots failed in {} of {} runs; the column robots_failed of {} says in which; --strict "
        "leaves such runs out of the means",
        runs, report.runs(), (sweep.directory / "runs.csv").string()));
  print_results(arguments, sweep, report, plotted);
  return results.failed() == 0 && all ? kDone : kFailed;
}

}  // namespace

Command add_sweep(CLI::App& program) {
  const auto arguments = std::make_shared<SweepArguments>();
  CLI::App& app =
      *program.add_subcommand("sweep", "run many variants on all cores; write a table, curves and plots");
  add_experiment_options(app, arguments->run);
  app.add_option("--seeds", arguments->seeds, "every variant runs with each of these seeds")->type_name("A..B");
  app.add_option("--set", arguments->set,
                 "values of a field: V1,V2,... or A..B, A..B:STEP, log:A..B:N; several --set give all combinations")
      ->allow_extra_args(false)
      ->type_name("FIELD=VALUES");
  app.add_option("--plot", arguments->plot,
                 "what the plots show: an observable of the experiment, or msd, displacement, spread, nearest, "
                 "polarisation or pushed (default: pushed where there are movable bodies, else msd)")
      ->type_name("OBSERVABLE");
  CLI::Option* const models =
      app.add_option(
             "--models", arguments->models,
             "model files, or directories of them; every point runs with each, and the points are ranked by their "
             "worst model")
          ->type_name("DIR|FILE...");
  models->excludes(app.get_option("--model"));
  app.add_option("--goal", arguments->goal,
                 "with --models: which value of the plotted observable is better: largest or smallest")
      ->check(CLI::IsMember({"largest", "smallest"}).description(""))
      ->capture_default_str()
      ->needs(models)
      ->type_name("WHICH");
  app.add_option("--colour-by", arguments->colour_by,
                 "a swept field: in the plots, all runs with the same value are one curve; or group: a curve per "
                 "group of robots")
      ->type_name("FIELD");
  app.add_option("--x-axis", arguments->x_axis,
                 "of the plot against a swept field: linear, log, or auto, which is log for values of equal ratios")
      ->check(CLI::IsMember({"auto", "linear", "log"}).description(""))
      ->capture_default_str()
      ->type_name("SCALE");
  app.add_option("--y-axis", arguments->y_axis, "of both plots: linear or log")
      ->check(CLI::IsMember({"linear", "log"}).description(""))
      ->capture_default_str()
      ->type_name("SCALE");
  app.add_option("--jobs", arguments->jobs, "runs at a time (default: one per core)")->type_name("N");
  app.add_option(
         "--latin", arguments->latin,
         "in place of all combinations, so many points that cover the ranges of --set evenly: a Latin hypercube")
      ->check(CLI::Range(std::size_t{1}, kMostSweepRuns).description(""))
      ->type_name("N");
  app.add_option("--latin-seed", arguments->latin_seed, "seed of the points of --latin")
      ->capture_default_str()
      ->type_name("N");
  add_strict_option(app, arguments->run);
  app.add_option("--resume", arguments->resume,
                 "go on with the sweep in this directory: runs that are done stay; --seeds may be more")
      ->type_name("DIR");
  CLI::Option* const slurm = app.add_flag("--slurm", arguments->slurm,
                                          "run as one array job of Slurm, wait for it, and merge its results");
  app.add_option("--slurm-program", arguments->slurm_options.program,
                 "with --slurm: what starts the program on the nodes, for a shell (default: its path here); for an "
                 "image: apptainer run /shared/kilotwin.sif")
      ->needs(slurm)
      ->type_name("COMMAND");
  app.add_option("--slurm-option", arguments->slurm_options.for_sbatch,
                 "an option for sbatch, such as --time=1:00:00")
      ->needs(slurm)
      ->allow_extra_args(false)
      ->type_name("OPTION");
  add_output_options(app, arguments->run.output, "runs/NAME-sweep, with a number added if it exists");
  app.footer("Example: kilotwin sweep experiments/disperse.txtpb --seeds 1..20 --set motion.noise=true,false");
  return {&app, [arguments] { return sweep(*arguments); }};
}

}  // namespace kilotwin::cli

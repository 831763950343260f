// `kilotwin-identify identify`: a model, its evaluation and a report from measured data.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/identify/data_kinds.hpp"
#include "clients/cli/identify/design_command.hpp"
#include "clients/cli/identify/unfinished.hpp"
#include "clients/cli/output.hpp"
#include "clients/cli/progress.hpp"
#include "clients/identify/data/table_import.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/report/report.hpp"
#include "clients/identify/result/result_json.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/experiment/clamp.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

struct IdentifyArguments {
  fs::path train, test;
  Output output;
  std::string columns, angle = "rad", frame = "plane";
  std::optional<double> unit_mm, unit_s;
  DesignArguments design;
  double horizon_s = 10;
  std::uint32_t threads = 2, draws = 0;
  bool quiet = false;
};

std::string csv_of(const std::vector<identify::Prediction>& predictions) {
  std::string text = "run,robot,time_s,before_x_mm,before_y_mm,after_x_mm,after_y_mm\n";
  for (const identify::Prediction& p : predictions) {
    fmt::format_to(std::back_inserter(text), "{},{},{:.10g},{:.4f},{:.4f},{:.4f},{:.4f}\n", p.run, p.robot,
                   p.time_s, p.before_x_mm, p.before_y_mm, p.after_x_mm, p.after_y_mm);
  }
  return text;
}

void print_errors(const identification::Result& result) {
  if (!result.before().rmse_mm().has_number_value()) {
    fmt::print("{}\n", result.held_out().in_words());
  } else {
    fmt::print(
        "prediction error, horizon {:g} s: {:.2f} mm with the base model, {:.2f} mm with effects; noise floor "
        "{:.2f} mm\n",
        result.horizon_s(), result.before().rmse_mm().number_value(), result.after().rmse_mm().number_value(),
        result.noise_floor_mm());
  }
  const identification::FreeRobots& free = result.free();
  if (free.after_mm().has_number_value() && free.share_of_rows() < 0.98)
    fmt::print(
        "away from walls and other robots ({:.0f} % of the predictions): {:.2f} mm, {:.2f} mm with effects\n",
        100 * free.share_of_rows(), free.before_mm().number_value(), free.after_mm().number_value());
  for (const std::string& words :
       {result.command_lag().in_words(), result.numbering().in_words(), result.check().in_words()})
    if (!words.empty()) fmt::print("{}\n", words);
  for (const std::string& name : result.check().dropped())
    fmt::print("{}: not written, because held-out data are predicted no better with it\n", name);
  if (result.has_unexplained())
    fmt::print("{}{}\n", result.unexplained().large() ? "unexplained: " : "", result.unexplained().in_words());
}

void print_results(const identification::Identification& found) {
  const identification::Result& result = found.result();
  for (const std::string& line : found.summary()) fmt::print("{}\n", line);
  if (found.summary().empty()) print_errors(result);
  for (const identification::Fault& fault : result.faults()) fmt::print("{}: {}\n", fault.kind(), fault.in_words());
  for (const identification::Effect& effect : result.effects())
    fmt::print("{}: {}\n", effect.name(), effect.in_words());
  if (result.effects().empty() && !result.unexplained().large())
    fmt::print("{}\n", result.check().dropped().empty()
                           ? "no significant effect: no tested effect improves on the base model"
                           : "no effect is written: the base model predicts held-out data as well");
  if (result.has_next()) fmt::print("next: {}\n", result.next());
}

/// Draws as files that runs take: model-01.txtpb and so on.
void write_draws(std::vector<proto::Model> draws, const fs::path& train, const fs::path& directory) {
  if (draws.empty()) return;
  fs::create_directory(directory);
  const std::size_t digits = std::max<std::size_t>(2, std::to_string(draws.size()).size());
  for (std::size_t n = 0; n < draws.size(); ++n) {
    clamp_to_ranges(draws[n]);
    const std::string remark = fmt::format("Draw {} of {} from the posterior of the model identified from {}.",
                                           n + 1, draws.size(), train.string());
    os::write_file(directory / fmt::format("model-{:0{}}.txtpb", n + 1, digits),
                   identify::text_of(draws[n], remark));
  }
}

/// Candidates as files that `--design` reads.
void write_candidates(const std::vector<std::pair<std::string, proto::Model>>& candidates, const fs::path& train,
                      const fs::path& directory) {
  if (candidates.empty()) return;
  fs::create_directory(directory);
  for (const auto& [name, found] : candidates) {
    proto::Model model = found;
    clamp_to_ranges(model);
    const std::string remark = fmt::format(
        "Data of {} do not tell this model from model.txtpb: {} in place of another effect.", train.string(), name);
    os::write_file(directory / (name + ".txtpb"), identify::text_of(model, remark));
  }
}

/// Whether options state the format of tables.
bool states_format(const IdentifyArguments& arguments) {
  return !arguments.columns.empty() || arguments.unit_mm || arguments.unit_s || arguments.angle != "rad" ||
         arguments.frame != "plane";
}

/// The kind of the data; both directories must hold the same. Throws UserError.
const DataKind& checked_kind(const IdentifyArguments& arguments) {
  if (states_format(arguments)) {
    for (const auto& [option, data] :
         {std::pair("--train", &arguments.train), std::pair("--test", &arguments.test)})
      if (!data->empty() && !fs::is_directory(*data))
        throw UserError(fmt::format("{} {}: is no directory; name one that holds tables", option, data->string()));
    return kind_of_tables();
  }
  const DataKind& kind = kind_of_data("--train", arguments.train);
  if (!arguments.test.empty() && &kind_of_data("--test", arguments.test) != &kind)
    throw UserError(fmt::format("--test {}: does not hold {}; give the same kind of data as --train",
                                arguments.test.string(), kind.name));
  if (arguments.draws > 0 && !kind.has_draws)
    throw UserError(fmt::format(
        "--draws: models are drawn from the posterior of a fit to trajectories, and {} holds other data; leave out "
        "--draws",
        arguments.train.string()));
  return kind;
}

/// The names, units and axes that the options state.
std::optional<identify::TableFormat> format_of(const IdentifyArguments& arguments) {
  if (!states_format(arguments)) return std::nullopt;
  identify::TableFormat format;
  if (!arguments.columns.empty()) identify::set_columns(format, arguments.columns);
  format.unit_mm = arguments.unit_mm.value_or(1);
  format.unit_s = arguments.unit_s.value_or(1);
  format.degrees = arguments.angle == "deg";
  format.image = arguments.frame == "image";
  return format;
}

int identify_data(const IdentifyArguments& arguments) {
  if (!(arguments.horizon_s > 0)) throw UserError("--horizon: give a number of seconds above 0");
  warn_beyond_cores("--threads", arguments.threads);
  // Before --force removes an older result.
  const DataKind& kind = checked_kind(arguments);
  const std::optional<identify::TableFormat> format = format_of(arguments);
  const fs::path fallback = "identified";
  const fs::path out = make_plain_output(arguments.output, fallback, {arguments.train, arguments.test});
  Unfinished unfinished(out);
  identify::Options options;
  options.horizon_s = arguments.horizon_s;
  options.threads = arguments.threads;
  options.draws = arguments.draws;
  options.model_file = (out / "model.txtpb").string();
  std::optional<WorkProgress> progress(std::in_place, !arguments.quiet);
  options.progress = [&](const stats::Work& work) { progress->begin(work); };
  progress->begin({"reading", arguments.train.string(), stats::Work::kSame});
  identify::Identified found =
      identify::identified_by(*kind.read({arguments.train, arguments.test, out, format}, options), options);

  progress->begin({"drawing the report", "", stats::Work::kSame});
  clamp_to_ranges(found.model);
  os::write_file(options.model_file,
                 identify::text_of(found.model, fmt::format("Identified from {}.", arguments.train.string())));
  write_draws(found.draws, arguments.train, out / "draws");
  write_candidates(found.candidates, arguments.train, out / "candidates");
  os::write_file(out / "result.json", identify::json_of(found.found.result()).dump(2) + "\n");
  os::write_file(out / "predictions.csv", csv_of(found.predictions));
  identify::write_report(found.found, out / "report.html");
  unfinished.keep();
  progress.reset();
  if (!arguments.quiet) {
    print_results(found.found);
    fmt::print("results {}: report.html, model.txtpb, result.json, predictions.csv\n",
               place_in_words(out, arguments.output, fallback));
  }
  return kDone;
}

/// Options of the plan, which other uses of the command refuse.
constexpr std::array kDesignOptions = {"--candidate", "--duration", "--robots",     "--arena",
                                       "--every",     "--seed",     "--no-headings"};

/// Options of data, which a plan refuses.
constexpr std::array kDataOptions = {"--horizon", "--draws", "--columns", "--unit-mm",
                                     "--unit-s",  "--angle", "--frame"};

void add_design_options(CLI::App& app, DesignArguments& design) {
  app.add_option(
         "--design", design.result,
         "plan the next recording instead, from the result in this directory: commands and start places that "
         "answer most per minute")
      ->type_name("DIR");
  app.add_option("--candidate", design.candidates,
                 "with --design: a model that the recording is to tell from DIR/model.txtpb; repeatable (default: "
                 "those in DIR/candidates; without any, the parameters of the model are in question)")
      ->allow_extra_args(false)
      ->type_name("FILE");
  app.add_option("--duration", design.duration_s, "with --design: length of the recording, s")
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--robots", design.robots, "with --design: number of robots (default: as many as in the data)")
      ->type_name("N");
  app.add_option("--arena", design.arena, "with --design: size of the arena, mm (default: the walls of the result)")
      ->type_name("WIDTHxHEIGHT");
  app.add_option("--every", design.every_s, "with --design: time between two pictures of the tracker, s")
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--seed", design.seed, "with --design: seed of the search")->capture_default_str()->type_name("N");
  app.add_flag("--no-headings", design.no_headings, "with --design: the tracker measures no headings");
}

int identify_or_plan(IdentifyArguments& arguments, const CLI::App& app) {
  const bool plans = !arguments.design.result.empty();
  if (plans) {
    if (!arguments.train.empty() || !arguments.test.empty())
      throw UserError("--design: plans from a result; leave out --train and --test");
    for (const char* option : kDataOptions)
      if (app.count(option) > 0) throw UserError(fmt::format("{}: belongs to --train; leave it out", option));
    warn_beyond_cores("--threads", arguments.threads);
    arguments.design.threads = arguments.threads;
    arguments.design.quiet = arguments.quiet;
    return plan_recording(arguments.design, arguments.output);
  }
  for (const char* option : kDesignOptions)
    if (app.count(option) > 0) throw UserError(fmt::format("{}: belongs to --design DIR", option));
  if (arguments.train.empty())
    throw UserError("--train: give a directory of measured data; or plan a recording with --design DIR");
  return identify_data(arguments);
}

}  // namespace

Command add_identify(CLI::App& program) {
  const auto arguments = std::make_shared<IdentifyArguments>();
  CLI::App& app =
      *program.add_subcommand("identify", "fit the model to measured data and find effects that it lacks");
  app.add_option("--train", arguments->train, "directory of measured data to fit to")->type_name("DIR");
  app.add_option("--test", arguments->test,
                 "directory of measured data to predict, never fitted to (default: a part of --train is held out)")
      ->type_name("DIR");
  app.add_option("--columns", arguments->columns,
                 "names of the columns of a tracker's tables: time=t,robot=ID,x=px,y=py,heading=theta,run=trial")
      ->type_name("NAMES");
  app.add_option("--unit-mm", arguments->unit_mm, "length of a unit of x and y, mm: 1000 for metres (default: 1)")
      ->check(CLI::Range(1e-6, 1e6).description(""))
      ->type_name("MM");
  app.add_option("--unit-s", arguments->unit_s,
                 "duration of a unit of time, s: 0.001 for milliseconds, 0.04 for frames at 25 Hz (default: 1)")
      ->check(CLI::Range(1e-9, 1e6).description(""))
      ->type_name("S");
  app.add_option("--angle", arguments->angle, "unit of the headings: rad or deg")
      ->check(CLI::IsMember({"rad", "deg"}).description(""))
      ->capture_default_str()
      ->type_name("UNIT");
  app.add_option("--frame", arguments->frame,
                 "axes: plane, y upwards and headings anticlockwise; image, y downwards and headings clockwise")
      ->check(CLI::IsMember({"plane", "image"}).description(""))
      ->capture_default_str()
      ->type_name("AXES");
  add_output_options(app, arguments->output, "identified, with a number added if it exists");
  app.add_option("--horizon", arguments->horizon_s, "time from the last measurement used to a prediction, s")
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--threads", arguments->threads, "threads to work on")
      ->check(CLI::Range(1, 256).description(""))
      ->capture_default_str()
      ->type_name("N");
  app.add_option(
         "--draws", arguments->draws,
         "as many models from the posterior, as OUT/draws/model-01.txtpb and so on: for the options --models of "
         "sweep and tune")
      ->check(CLI::Range(0, 1000).description(""))
      ->capture_default_str()
      ->type_name("N");
  add_design_options(app, arguments->design);
  app.add_flag("--quiet", arguments->quiet, "no progress and no summary on the screen");
  app.footer(
      "Example: kilotwin identify --train measured --out found. measured/ holds trajectories.csv with the columns "
      "run,robot,time_s,x_mm,y_mm.");
  return {&app, [arguments, &app] { return identify_or_plan(*arguments, app); }};
}

}  // namespace kilotwin::cli

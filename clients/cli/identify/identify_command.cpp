// `kilotwin-identify identify`: a model, its evaluation and a report from measured data.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/identify/other_data.hpp"
#include "clients/cli/output.hpp"
#include "clients/cli/progress.hpp"
#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/data/plausibility.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "clients/identify/report/prediction_residuals.hpp"
#include "clients/identify/report/report.hpp"
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

/// For trajectories. `out`: gets imported data as trajectories. `faults` receives what was excluded.
identify::Identified identify_trajectories(const IdentifyArguments& arguments, const fs::path& out,
                                           const identify::Options& options,
                                           std::vector<identify::DataFault>& faults) {
  identify::MeasuredSet train = identify::load_or_import(arguments.train, out / "imported-train");
  identify::demand_plausible(train, arguments.train.string());
  options.progress(0, "checking for faults of the data");
  // No robot can produce these samples: they are excluded before the fit.
  faults = identify::exclude_faults(train);
  std::optional<identify::MeasuredSet> test;
  if (!arguments.test.empty()) {
    test = identify::load_or_import(arguments.test, out / "imported-test");
    identify::demand_plausible(*test, arguments.test.string());
    identify::demand_longer_than(*test, arguments.horizon_s, false, arguments.test.string());
    identify::hold_out_for_choice(train);
  } else {
    identify::hold_out_part(train);
    const bool held_out = std::any_of(train.runs.begin(), train.runs.end(), [](const identify::Run& run) {
      return std::any_of(run.tracks.begin(), run.tracks.end(), [](const identify::Track& t) { return t.held_out; });
    });
    identify::demand_longer_than(train, arguments.horizon_s, held_out, arguments.train.string());
  }
  if (test) {
    // Faults of the test data are excluded from nothing: each row is predicted.
    identify::MeasuredSet copy = *test;
    for (identify::DataFault& fault : identify::exclude_faults(copy)) {
      fault.of_test = true;
      faults.push_back(std::move(fault));
    }
  }
  identify::Identified found = identify::identify(train, test ? &*test : nullptr, options);
  found.document["contract"]["faults"] = identify::document_of(faults);
  const nlohmann::json residuals =
      identify::residual_parts(test ? *test : train, found.predictions, arguments.horizon_s);
  for (const auto& [part, content] : residuals.items()) {
    if (!found.document.contains(part)) found.document[part] = content;
  }
  return found;
}

/// Removes the directory unless it is kept: a command that fails leaves no files.
class Unfinished {
 public:
  explicit Unfinished(fs::path directory) : directory_(std::move(directory)) {}
  ~Unfinished() {
    std::error_code ignored;
    if (!kept_) fs::remove_all(directory_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  void keep() { kept_ = true; }

 private:
  fs::path directory_;
  bool kept_ = false;
};

/// Whether something large is left unexplained. Results of other kinds of data do not say.
bool is_unexplained(const nlohmann::json& result) {
  const auto left = result.find("unexplained");
  return left != result.end() && left->at("large").get<bool>();
}

void print_errors(const nlohmann::json& result, double horizon_s) {
  const auto error = [&](const char* when) -> const nlohmann::json& { return result.at(when).at("rmse_mm"); };
  if (error("before").is_null()) {
    fmt::print("{}\n", result.at("held_out").at("in_words").get<std::string>());
  } else {
    fmt::print(
        "prediction error, horizon {:g} s: {:.2f} mm with the base model, {:.2f} mm with effects; noise floor "
        "{:.2f} mm\n",
        horizon_s, error("before").get<double>(), error("after").get<double>(),
        result.at("noise_floor_mm").get<double>());
  }
  if (const auto free = result.find("free");
      free != result.end() && !free->at("after_mm").is_null() && free->at("share_of_rows").get<double>() < 0.98)
    fmt::print(
        "away from walls and other robots ({:.0f} % of the predictions): {:.2f} mm, {:.2f} mm with effects\n",
        100 * free->at("share_of_rows").get<double>(), free->at("before_mm").get<double>(),
        free->at("after_mm").get<double>());
  for (const char* of : {"command_lag", "numbering", "check"}) {
    const auto found = result.find(of);
    if (found != result.end() && found->contains("in_words"))
      fmt::print("{}\n", found->at("in_words").get<std::string>());
  }
  // Results of other kinds of data have neither.
  if (const auto check = result.find("check"); check != result.end()) {
    for (const auto& name : check->at("dropped"))
      fmt::print("{}: not written, because held-out data are predicted no better with it\n",
                 name.get<std::string>());
  }
  if (const auto left = result.find("unexplained"); left != result.end())
    fmt::print("{}{}\n", is_unexplained(result) ? "unexplained: " : "", left->at("in_words").get<std::string>());
}

void print_results(const IdentifyArguments& arguments, const identify::Identified& found,
                   const std::vector<identify::DataFault>& faults) {
  const auto& result = found.document.at("contract");
  if (found.document.contains("summary")) {
    for (const auto& line : found.document.at("summary")) fmt::print("{}\n", line.get<std::string>());
  } else {
    print_errors(result, arguments.horizon_s);
  }
  for (const identify::DataFault& fault : faults) fmt::print("{}: {}\n", name_of(fault.kind), fault.in_words());
  for (const auto& effect : result.at("effects"))
    fmt::print("{}: {}\n", effect.at("name").get<std::string>(), effect.at("in_words").get<std::string>());
  if (result.at("effects").empty() && !is_unexplained(result)) {
    const bool dropped = result.contains("check") && !result.at("check").at("dropped").empty();
    fmt::print("{}\n", dropped ? "no effect is written: the base model predicts held-out data as well"
                               : "no significant effect: no tested effect improves on the base model");
  }
  if (const auto next = result.find("next"); next != result.end())
    fmt::print("next: {}\n", next->get<std::string>());
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

int identify_data(const IdentifyArguments& arguments) {
  if (!(arguments.horizon_s > 0)) throw UserError("--horizon: give a number of seconds above 0");
  warn_beyond_cores("--threads", arguments.threads);
  demand_known_data("--train", arguments.train);
  if (!arguments.test.empty()) demand_known_data("--test", arguments.test);
  const fs::path fallback = "identified";
  const fs::path out = make_plain_output(arguments.output, fallback, {arguments.train, arguments.test});
  Unfinished unfinished(out);
  identify::Options options;
  options.horizon_s = arguments.horizon_s;
  options.threads = arguments.threads;
  options.draws = arguments.draws;
  options.model_file = (out / "model.txtpb").string();
  std::optional<Progress> progress(std::in_place, !arguments.quiet);
  // Reading takes the first 2 %, drawing the last 3 %.
  options.progress = [&](double share, const std::string& what) {
    progress->show(0.02 + 0.95 * share, what, what);
  };
  progress->show(0, "reading " + arguments.train.string(), "reading");
  std::vector<identify::DataFault> faults;
  identify::Identified found;
  if (std::optional<identify::Identified> other =
          identify_other_data(arguments.train, arguments.test, out, options)) {
    found = std::move(*other);
  } else {
    found = identify_trajectories(arguments, out, options, faults);
  }

  progress->show(0.97, "drawing the report", "drawing");
  clamp_to_ranges(found.model);
  os::write_file(options.model_file,
                 identify::text_of(found.model, fmt::format("Identified from {}.", arguments.train.string())));
  write_draws(found.draws, arguments.train, out / "draws");
  os::write_file(out / "result.json", found.document.at("contract").dump(2) + "\n");
  os::write_file(out / "predictions.csv", csv_of(found.predictions));
  identify::write_report(found.document, out / "report.html");
  unfinished.keep();
  progress.reset();
  if (!arguments.quiet) {
    print_results(arguments, found, faults);
    fmt::print("results {}: report.html, model.txtpb, result.json, predictions.csv\n",
               place_in_words(out, arguments.output, fallback));
  }
  return kDone;
}

}  // namespace

Command add_identify(CLI::App& program) {
  const auto arguments = std::make_shared<IdentifyArguments>();
  CLI::App& app =
      *program.add_subcommand("identify", "fit the model to measured data and find effects that it lacks");
  app.add_option("--train", arguments->train, "directory of measured data to fit to")->required()->type_name("DIR");
  app.add_option("--test", arguments->test,
                 "directory of measured data to predict, never fitted to (default: a part of --train is held out)")
      ->type_name("DIR");
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
  app.add_flag("--quiet", arguments->quiet, "no progress and no summary on the screen");
  app.footer(
      "Example: kilotwin identify --train measured --out found. measured/ holds trajectories.csv with the columns "
      "run,robot,time_s,x_mm,y_mm.");
  return {&app, [arguments] { return identify_data(*arguments); }};
}

}  // namespace kilotwin::cli

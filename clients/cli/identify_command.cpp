#include "clients/cli/identify_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "clients/cli/other_data.hpp"
#include "clients/cli/work_progress.hpp"
#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/data/plausibility.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/report/prediction_residuals.hpp"
#include "clients/identify/report/report.hpp"
#include "clients/recorder/file.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

std::string csv_of(const std::vector<identify::Prediction>& predictions) {
  std::string text = "run,robot,time_s,before_x_mm,before_y_mm,after_x_mm,after_y_mm\n";
  for (const identify::Prediction& p : predictions) {
    fmt::format_to(std::back_inserter(text), "{},{},{:.10g},{:.4f},{:.4f},{:.4f},{:.4f}\n", p.run, p.robot,
                   p.time_s, p.before_x_mm, p.before_y_mm, p.after_x_mm, p.after_y_mm);
  }
  return text;
}

void make_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error || !fs::is_directory(directory))
    throw UserError(fmt::format("--out {}: is no directory and cannot be made one", directory.string()));
}

/// For trajectories. `faults` receives what was excluded.
identify::Identified identify_trajectories(const IdentifyArguments& arguments, const identify::Options& options,
                                           std::vector<identify::DataFault>& faults) {
  identify::MeasuredSet train = identify::load_or_import(arguments.train, arguments.out / "imported-train");
  identify::demand_plausible(train, arguments.train.string());
  options.progress(0, "faults of the data");
  // No robot can produce these samples: they are excluded before the fit.
  faults = identify::exclude_faults(train);
  std::optional<identify::MeasuredSet> test;
  if (!arguments.test.empty()) {
    test = identify::load_or_import(arguments.test, arguments.out / "imported-test");
    identify::demand_plausible(*test, arguments.test.string());
    identify::demand_longer_than(*test, arguments.horizon_s, false, arguments.test.string());
  } else {
    identify::hold_out_part(train);
    const bool held_out = std::any_of(train.runs.begin(), train.runs.end(), [](const identify::Run& run) {
      return std::any_of(run.tracks.begin(), run.tracks.end(), [](const identify::Track& t) { return t.held_out; });
    });
    identify::demand_longer_than(train, arguments.horizon_s, held_out, arguments.train.string());
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

}  // namespace

int identify_command(const IdentifyArguments& arguments) {
  if (!(arguments.horizon_s > 0)) throw UserError("--horizon: give a number of seconds above 0");
  make_directory(arguments.out);
  identify::Options options;
  options.horizon_s = arguments.horizon_s;
  options.threads = arguments.threads;
  std::optional<WorkProgress> progress(std::in_place, !arguments.quiet);
  // Reading takes the first 2 %, drawing the last 3 %.
  options.progress = [&](double share, const std::string& what) { progress->show(0.02 + 0.95 * share, what); };
  progress->show(0, "reading " + arguments.train.string());
  std::vector<identify::DataFault> faults;
  identify::Identified found;
  if (std::optional<identify::Identified> other =
          identify_other_data(arguments.train, arguments.test, arguments.out, options)) {
    found = std::move(*other);
  } else {
    found = identify_trajectories(arguments, options, faults);
  }

  progress->show(0.97, "drawing the report");
  recorder::write_file(
      arguments.out / "model.txtpb",
      identify::text_of(found.model, fmt::format("Identified from {}.", arguments.train.string())));
  recorder::write_file(arguments.out / "result.json", found.document.at("contract").dump(2) + "\n");
  recorder::write_file(arguments.out / "predictions.csv", csv_of(found.predictions));
  identify::write_report(found.document, arguments.out / "report.html");
  progress->show(1, "done");
  progress.reset();
  if (!arguments.quiet) {
    const auto& result = found.document.at("contract");
    if (found.document.contains("summary")) {
      for (const auto& line : found.document.at("summary")) fmt::print("{}\n", line.get<std::string>());
    } else {
      const auto number = [&](const char* when) { return result.at(when).at("rmse_mm").get<double>(); };
      fmt::print("error {:.2f} mm before, {:.2f} mm after, {:.2f} mm at best, {:g} s ahead\n", number("before"),
                 number("after"), result.at("noise_floor_mm").get<double>(), arguments.horizon_s);
    }
    for (const identify::DataFault& fault : faults) fmt::print("{}: {}\n", name_of(fault.kind), fault.in_words());
    for (const auto& effect : result.at("effects"))
      fmt::print("{}: {}\n", effect.at("name").get<std::string>(), effect.at("in_words").get<std::string>());
    if (result.at("effects").empty()) fmt::print("no effect found: the base model explains this data\n");
    fmt::print("{}\n", arguments.out.string());
  }
  return 0;
}

}  // namespace kilotwin::cli

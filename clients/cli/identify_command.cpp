#include "clients/cli/identify_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <optional>

#include "clients/cli/other_data.hpp"
#include "clients/identify/data_faults.hpp"
#include "clients/identify/identify.hpp"
#include "clients/identify/import.hpp"
#include "clients/identify/prediction_residuals.hpp"
#include "clients/identify/report.hpp"
#include "clients/identify/write_model.hpp"
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

/// Of trajectories. `faults` gets what was excluded.
identify::Identified identify_trajectories(const IdentifyArguments& arguments, const identify::Options& options,
                                           std::vector<identify::DataFault>& faults) {
  identify::MeasuredSet train = identify::load_or_import(arguments.train, arguments.out / "imported-train");
  // Whatever robots do, they do not do this: it is excluded before anything is fitted, and never modelled.
  faults = identify::exclude_faults(train);
  std::optional<identify::MeasuredSet> test;
  if (!arguments.test.empty()) {
    test = identify::load_or_import(arguments.test, arguments.out / "imported-test");
  } else {
    identify::hold_out_part(train);
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
  const bool terminal = isatty(STDERR_FILENO) != 0;
  options.progress = [&](double part, const std::string& what) {
    if (arguments.quiet) return;
    if (terminal) {
      fmt::print(stderr, "\r{:3.0f} %  {:<70}{}", 100 * part, what.substr(0, 70), part >= 1 ? "\n" : "");
    } else {
      fmt::print(stderr, "{:3.0f} %  {}\n", 100 * part, what);
    }
  };
  std::vector<identify::DataFault> faults;
  identify::Identified found;
  if (std::optional<identify::Identified> other =
          identify_other_data(arguments.train, arguments.test, arguments.out, options)) {
    found = std::move(*other);
  } else {
    found = identify_trajectories(arguments, options, faults);
  }

  recorder::write_file(
      arguments.out / "model.txtpb",
      identify::text_of(found.model, fmt::format("Identified from {}.", arguments.train.string())));
  recorder::write_file(arguments.out / "result.json", found.document.at("contract").dump(2) + "\n");
  recorder::write_file(arguments.out / "predictions.csv", csv_of(found.predictions));
  identify::write_report(found.document, arguments.out / "report.html");
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

#include "clients/cli/identify/radio_data.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <sstream>

#include "clients/identify/radio/radio_fit.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

/// Simulated runs per effect and set, and sampled swarms: some minutes of one core in total.
constexpr int kRuns = 24, kSwarms = 80;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw RunError(fmt::format("{}: cannot be read", file.string()));
  return text.str();
}

/// Mean over the sets of one error of a step, in absolute value.
double mean_of(const json& step, const char* error) {
  double sum = 0, sets = 0;
  for (const json& of_set : step.at("errors")) {
    sum += std::abs(of_set.at(error).get<double>());
    ++sets;
  }
  return sets > 0 ? sum / sets : 0;
}

json summary_of(const json& step) {
  json summary = json::object();
  for (const char* error : {"deficit", "sent_error", "near_worst", "far_worst", "silent_error", "run_spread_error"})
    summary[error] = mean_of(step, error);
  return summary;
}

std::string figure(const json& value) { return fmt::format("{:.3f}", value.get<double>()); }

/// Errors of each step on held-out runs, by set.
json table_of_errors(const json& steps) {
  json rows = json::array();
  for (const json& step : steps) {
    for (const auto& [set, e] : step.at("errors").items())
      rows.push_back({step.at("name"), set, fmt::format("{:+.1f}", e.at("sent_error").get<double>()),
                      figure(e.at("near_worst")), figure(e.at("far_worst")), figure(e.at("silent_error")),
                      figure(e.at("run_spread_error")), figure(e.at("deficit"))});
  }
  return {
      {"id", "errors"},
      {"title", "Errors on held-out runs, effect by effect"},
      {"lead",
       "Sent: messages per robot, simulated minus measured. Near, far: largest error of the reception share, up to "
       "105 mm and beyond 125 mm. Silent: error of the share of pairs without reception. Runs: error of the "
       "standard deviation between runs. Deficit: log-likelihood of the counts below that of the training runs' "
       "means, per pair and run."},
      {"head", {"with", "set", "sent", "near", "far", "silent", "runs", "deficit, nat"}},
      {"rows", rows}};
}

/// Predictive check on new robots: does the measured set look like a sample of the fitted population?
json table_of_population(const json& population) {
  json rows = json::array();
  for (const json& c : population)
    rows.push_back({c.at("set"), fmt::format("{:.0f}", c.at("distance_mm").get<double>()), figure(c.at("measured")),
                    figure(c.at("median")),
                    fmt::format("{:.2f} to {:.2f}{}", c.at("low").get<double>(), c.at("high").get<double>(),
                                c.at("inside").get<bool>() ? "" : ", outside")});
  return {
      {"id", "population"},
      {"title", "Predictive check: new robots"},
      {"lead",
       "Reception share over distance: measured on held-out runs, and simulated for random swarms of the fitted "
       "population."},
      {"head", {"set", "distance, mm", "measured", "median swarm", "95 % of swarms"}},
      {"rows", rows}};
}

}  // namespace

bool has_radio_runs(const fs::path& directory) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("comm_tau") && name.find("_run") != std::string::npos && name.ends_with(".dat"))
      return true;
  }
  return false;
}

identify::Identified identify_radio_runs(const fs::path& train, const fs::path& test, const fs::path& out,
                                         const identify::Options& options) {
  const auto started = std::chrono::steady_clock::now();
  radio_fit::FitOptions fit;
  fit.train = train;
  fit.test = test;
  fit.out = out / "radio";
  fit.runs = kRuns;
  fit.swarms = kSwarms;
  fit.progress = options.progress ? options.progress : [](double, const std::string&) {};
  radio_fit::fit_radio(fit);

  const json fitted = json::parse(text_of(fit.out / "result.json"));
  identify::Identified result;
  if (!google::protobuf::TextFormat::ParseFromString(text_of(fit.out / "model.txtpb"), &result.model))
    throw RunError(fmt::format("{}: is not a model", (fit.out / "model.txtpb").string()));
  const json& steps = fitted.at("effects");
  // The first step is the ARGoS model.
  json effects = json::array();
  for (std::size_t s = 1; s < steps.size(); ++s) {
    const json& step = steps[s];
    const double before = mean_of(steps[s - 1], "deficit"), after = mean_of(step, "deficit");
    json facts = {{"deficit", fmt::format("{:.3f} nat before, {:.3f} nat with it", before, after)}};
    if (const std::string what = step.at("evidence").value("what", ""); !what.empty()) facts["evidence"] = what;
    effects.push_back({{"name", step.at("name")},
                       {"covariates", step.at("covariates")},
                       {"acts_on", "radio"},
                       {"evidence", step.at("evidence")},
                       {"parameters", step.at("parameters")},
                       {"deficit_before", before},
                       {"deficit_after", after},
                       {"facts", facts},
                       {"in_words", fmt::format("{}: {}", step.at("name").get<std::string>(),
                                                step.at("parameters").at("added").get<std::string>())}});
  }
  const json before = summary_of(steps.front()), after = summary_of(steps.back());
  json& contract = result.document["contract"];
  contract = {{"before", before},           {"after", after},
              {"effects", effects},         {"rejected", json::array()},
              {"ambiguous", json::array()}, {"faults", json::array()}};
  for (const auto& [key, value] : fitted.items()) {
    if (key != "effects") contract[key] = value;
  }
  const auto of = [](const json& summary, const char* error) { return summary.at(error).get<double>(); };
  const std::string verdict = fmt::format(
      "On held-out runs, the log-likelihood of the counts is {:.2f} nat per pair and run below that of the "
      "training "
      "runs' means in the ARGoS paper's model, and {:.2f} nat below with all effects. The largest error of the "
      "reception "
      "share is {:.3f} up to 105 mm ({:.3f} before) and {:.3f} beyond 125 mm ({:.3f} before).",
      of(before, "deficit"), of(after, "deficit"), of(after, "near_worst"), of(before, "near_worst"),
      of(after, "far_worst"), of(before, "far_worst"));
  result.document["headline"] = "Radio model of these robots";
  result.document["verdict"] = verdict;
  result.document["summary"] = {verdict};
  result.document["bars"] = {
      {{"kind", "before"}, {"name", "the ARGoS paper's model"}, {"value", of(before, "deficit")}, {"unit", "nat"}},
      {{"kind", "after"}, {"name", "with effects"}, {"value", of(after, "deficit")}, {"unit", "nat"}}};
  result.document["tables"] = {table_of_errors(steps), table_of_population(fitted.at("population"))};
  result.document["set"] = {{"has_headings", false}, {"has_commands", false}};
  result.document["seconds"]["all"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace kilotwin::cli

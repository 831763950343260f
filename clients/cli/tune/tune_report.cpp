#include "clients/cli/tune/tune_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/cli/shell_words.hpp"
#include "clients/report/html.hpp"
#include "clients/report/plot.hpp"
#include "clients/report/templates.hpp"
#include "core/base/say.hpp"
#include "core/csv/csv_writer.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

using nlohmann::ordered_json;
using tune::Estimate;
using tune::Parameter;
using tune::Trial;

double in_units(const TuneResult& r, double value) { return r.goal.largest ? value : -value; }

std::string with_error(double mean, double standard_error) {
  return fmt::format("{:.5g} ±{:.2g}", mean, standard_error);
}

std::string value_text(const Parameter& p, double place) {
  const std::string setting = setting_at(p, place);
  return setting.substr(setting.find('=') + 1);
}

ordered_json values_at(const TuneResult& r, const tune::Point& point) {
  ordered_json values;
  for (std::size_t i = 0; i < r.parameters.size(); ++i)
    values[r.parameters[i].name] = value_at(r.parameters[i], point[i]);
  return values;
}

ordered_json json_of(const TuneResult& r, const Estimate& e, bool signed_value = true) {
  return {{"mean", signed_value ? in_units(r, e.mean) : e.mean},
          {"standard_error", e.standard_error},
          {"runs", e.count}};
}

std::string json_text(const TuneResult& r) {
  ordered_json json{{"experiment", r.name},
                    {"observable", r.goal.observable},
                    {"goal", r.goal.largest ? "largest" : "smallest"},
                    {"best", values_at(r, r.tuned.best)},
                    {"value", json_of(r, r.tuned.value)}};
  if (r.present.count > 0) {
    json["present"] = json_of(r, r.present);
    json["gain"] = json_of(r, r.gain, false);
  }
  for (const std::filesystem::path& model : r.goal.models) json["models"].push_back(model.string());
  json["run"] = r.run_words;
  for (const Trial& trial : r.tuned.again)
    json["measured_again"].push_back({{"values", values_at(r, trial.point)},
                                      {"mean", in_units(r, trial.mean)},
                                      {"standard_error", trial.standard_error},
                                      {"failed", trial.failed}});
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

void write_points(const TuneResult& r, const std::filesystem::path& file) {
  std::string header = "generation";
  for (const Parameter& p : r.parameters) header += "," + csv_cell(p.name);
  CsvWriter writer(file, header + fmt::format(",{},{}_se,failed", r.goal.observable, r.goal.observable));
  for (const Trial& trial : r.tuned.trials) {
    std::string row = std::to_string(trial.generation);
    for (std::size_t i = 0; i < r.parameters.size(); ++i) row += "," + value_text(r.parameters[i], trial.point[i]);
    row += std::isfinite(trial.mean) ? fmt::format(",{:.10g},{:.4g}", in_units(r, trial.mean), trial.standard_error)
                                     : std::string(",,");
    writer.rows() += row + fmt::format(",{}\n", trial.failed);
  }
  writer.close();
}

/// Every point of the search, and the mean of each generation.
Plot search_plot(const TuneResult& r) {
  Plot plot;
  plot.title = fmt::format("{}: {} in the search", r.name, r.goal.observable);
  plot.subtitle = fmt::format("each point: mean of {} runs; line: mean of a generation", r.seeds);
  plot.x_name = "generation";
  plot.y_name = r.goal.observable;
  PlotSeries points, means;
  points.name = "points";
  points.line = false;
  means.name = "mean of the generation";
  means.points = false;
  std::vector<double> of_generation;
  for (std::size_t i = 0; i < r.tuned.trials.size(); ++i) {
    const Trial& trial = r.tuned.trials[i];
    if (std::isfinite(trial.mean)) {
      points.x.push_back(static_cast<double>(trial.generation));
      points.y.push_back(in_units(r, trial.mean));
      of_generation.push_back(in_units(r, trial.mean));
    }
    const bool last = i + 1 == r.tuned.trials.size() || r.tuned.trials[i + 1].generation != trial.generation;
    if (!last || of_generation.empty()) continue;
    means.x.push_back(static_cast<double>(trial.generation));
    means.y.push_back(tune::estimate(of_generation).mean);
    of_generation.clear();
  }
  plot.series = {std::move(points), std::move(means)};
  return plot;
}

std::string command_text(const TuneResult& r) {
  std::string text;
  for (const std::string& word : r.run_words) text += (text.empty() ? "" : " ") + shell_word(word);
  return text;
}

html::Data page_data(const TuneResult& r, const recorder::Provenance& provenance) {
  using html::Data;
  const auto object = [](std::initializer_list<std::pair<const char*, std::string>> fields) {
    Data data{Data::type::object};
    for (const auto& [key, value] : fields) data.set(key, value);
    return data;
  };
  std::vector<std::string> heads{"point"};
  for (const Parameter& p : r.parameters) heads.push_back(html::escaped(p.name));
  heads.push_back(html::escaped(r.goal.observable));
  html::Table table(heads);
  const auto row = [&](const std::string& name, const tune::Point* point, double mean, double standard_error) {
    std::vector<std::string> cells{name};
    for (std::size_t i = 0; i < r.parameters.size(); ++i)
      cells.push_back(point != nullptr ? value_text(r.parameters[i], (*point)[i]) : "as in the file");
    cells.push_back(with_error(mean, standard_error));
    table.row(cells);
  };
  row("best", &r.tuned.best, in_units(r, r.tuned.value.mean), r.tuned.value.standard_error);
  if (r.present.count > 0) row("present", nullptr, in_units(r, r.present.mean), r.present.standard_error);
  for (const Trial& trial : r.tuned.again)
    row("measured again", &trial.point, in_units(r, trial.mean), trial.standard_error);
  Data figures{Data::type::list};
  figures << object({{"image", html::image(plot_svg(search_plot(r)), "the search")},
                     {"caption", "Points of the search. With noise the best of them look better than they are."}});
  std::string words;
  for (const std::string& word : provenance.command_line) words += (words.empty() ? "" : " ") + shell_word(word);
  Data facts{Data::type::list};
  for (const auto& [fact, value] : {std::pair<const char*, std::string>{"command line", words},
                                    {"version", provenance.build},
                                    {"a run with the best values", command_text(r)}})
    facts << object({{"fact", fact}, {"value", value}});
  Data page =
      object({{"name", r.name}, {"date", provenance.date}, {"verdict", in_words(r)}, {"table", table.text()}});
  page.set("figures", figures);
  page.set("facts", facts);
  return page;
}

}  // namespace

std::string in_words(const TuneResult& r) {
  std::string text =
      fmt::format("{} {} ({} runs with seeds of their own)", r.goal.observable,
                  with_error(in_units(r, r.tuned.value.mean), r.tuned.value.standard_error), r.tuned.value.count);
  if (r.present.count > 0) {
    // Two standard errors: beyond chance by a test at 5 %.
    const bool beyond_chance = std::abs(r.gain.mean) > 2 * r.gain.standard_error;
    text += fmt::format(
        "; the experiment as it stands: {}; {} by {}{}",
        with_error(in_units(r, r.present.mean), r.present.standard_error), r.gain.mean >= 0 ? "better" : "worse",
        with_error(std::abs(r.gain.mean), r.gain.standard_error), beyond_chance ? "" : ", which may be chance");
  }
  return text;
}

void write_tune_report(const TuneResult& r, const std::filesystem::path& directory,
                       const recorder::Provenance& provenance) {
  write_points(r, directory / "points.csv");
  os::write_file(directory / "tune.json", json_text(r));
  if (!Gnuplot::installed()) {
    say("kilotwin: no plot and no report.html: gnuplot is not installed; scripts/setup installs it");
    return;
  }
  write_plot(search_plot(r), directory / "search.svg");
  os::write_file(directory / "report.html",
                 html::page("Kilotwin: " + r.name + " tuned",
                            html::rendered(html::templates::kTune, page_data(r, provenance))));
}

}  // namespace kilotwin::cli

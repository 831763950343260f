#include "clients/identify/report/report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <vector>

#include "clients/identify/report/report_effects.hpp"
#include "clients/identify/report/report_figures.hpp"
#include "clients/identify/report/report_plots.hpp"
#include "clients/identify/report/report_simulated.hpp"
#include "clients/identify/report/report_summary.hpp"
#include "clients/identify/report/report_text.hpp"
#include "clients/identify/report/report_unexplained.hpp"
#include "clients/report/html.hpp"
#include "core/os/files.hpp"

namespace kilotwin::identify {

using namespace report;
using html::escaped;

namespace {

std::string maps(const json& all, Figures& figures) {
  if (!all.is_array()) return "";
  std::string out;
  std::set<std::string> done;
  const auto find = [&](const std::string& target) -> const json* {
    for (const json& map : all) {
      if (text(map, "target") == target) return &map;
    }
    return nullptr;
  };
  for (const json& map : all) {
    const std::string target = text(map, "target");
    if (!done.insert(target).second) continue;
    if (target.size() > 2 && (target.ends_with("_x") || target.ends_with("_y"))) {
      const std::string stem = target.substr(0, target.size() - 2);
      const json *x = find(stem + "_x"), *y = find(stem + "_y");
      if (x != nullptr && y != nullptr) {
        done.insert(stem + "_x");
        done.insert(stem + "_y");
        out += figures.pair(plot_arrows(figures.plots(), *x, *y, "before"),
                            plot_arrows(figures.plots(), *x, *y, "after"),
                            fmt::format("Residual {} over the arena", words_of(stem)));
        continue;
      }
    }
    out += figures.pair(plot_map(figures.plots(), map, "before"), plot_map(figures.plots(), map, "after"),
                        fmt::format("Residual {} over the arena", words_of(target)));
  }
  return out;
}

std::string fault_list(const json& contract) {
  std::string out;
  for (const json& fault : part(contract, "faults")) {
    out += fmt::format("<li><b>{}</b> {}</li>\n", escaped(text(fault, "kind")), escaped(text(fault, "in_words")));
  }
  return out.empty() ? "" : "<ul class=\"faults\">" + out + "</ul>\n";
}

/// The numbers of an object as a table of two columns. `sd`: standard deviations by the same keys, shown as 95 % intervals.
std::string figures_of(const json& object, const json& sd = {}) {
  if (!object.is_object() || object.empty()) return "";
  html::Table table({"", ""});
  for (const auto& [key, value] : object.items()) {
    std::string shown = value.is_number_integer() ? value.dump()
                        : value.is_number()       ? figure(value.get<double>())
                                                  : "";
    if (value.is_string()) shown = escaped(value.get<std::string>());
    if (value.is_boolean()) shown = value.get<bool>() ? "yes" : "no";
    constexpr double kNormal95 = 1.96;
    if (const auto spread = number(sd, key.c_str())) shown += " ± " + figure(kNormal95 * *spread);
    if (!shown.empty()) table.row({escaped(html::with_unit(key)), shown});
  }
  return table.text("facts");
}

/// How the errors and the noise floor were estimated, as markup.
std::string better_lead(const json& contract) {
  std::string out;
  if (const std::string how = text(part(contract, "improvement"), "bounds_how"); !how.empty())
    out += "Intervals: " + escaped(how) + ". ";
  if (const std::string which = text(part(contract, "held_out"), "in_words"); !which.empty())
    out += escaped(which) + " ";
  if (const std::string how = text(contract, "noise_floor_how"); !how.empty())
    out += "Noise floor: " + escaped(how) + ".";
  const json& again = part(contract, "replicates");
  if (const auto floor = number(again, "floor_mm")) {
    out += fmt::format(
        " Replicates: the same commands were repeated in several runs ({} groups). The error that differs between "
        "repetitions is <b>{} mm</b>; no model of robot, time and command can predict it. The remaining repeatable "
        "error is {} mm.",
        text(again, "groups"), figure(floor), figure(number(again, "repeatable_mm")));
  }
  return out;
}

/// Further tables of the document, one section each.
std::string given_tables(const json& tables) {
  std::string out;
  for (const json& given : tables) {
    std::vector<std::string> heads;
    for (const json& head : part(given, "head")) heads.push_back(escaped(head.get<std::string>()));
    html::Table table(std::move(heads));
    for (const json& row : part(given, "rows")) {
      std::vector<std::string> cells;
      for (const json& cell : row) cells.push_back(escaped(cell.get<std::string>()));
      table.row(cells);
    }
    out += section(text(given, "id").c_str(), escaped(text(given, "title")).c_str(), escaped(text(given, "lead")),
                   table.text());
  }
  return out;
}

}  // namespace

std::string report_html(const json& document) {
  const json& contract = part(document, "contract");
  const json& plots = part(document, "covariate_plots");
  Gnuplot gnuplot;
  Figures figures(gnuplot);
  std::string page = fmt::format(
      "<header><p class=\"kicker\">Kilotwin · identified from measured data</p><h1>{}</h1>\n<p "
      "class=\"verdict\">{}</p>\n{}</header>\n",
      text(document, "headline").empty() ? headline(contract) : escaped(text(document, "headline")),
      text(document, "verdict").empty() ? verdict(contract) : escaped(text(document, "verdict")),
      part(document, "bars").is_array() ? given_bars(part(document, "bars")) : bars(contract));
  page += section("why", "Effects", "", cards(contract, document, figures));
  const std::size_t effects = part(contract, "effects").is_array() ? part(contract, "effects").size() : 0;
  const Errors errors = errors_of(contract);
  std::string better =
      figures.place(plot_horizon(gnuplot, part(document, "horizon")), "Prediction error over the horizon");
  if (effects > 0) {
    better += figures.place(plot_steps(gnuplot, part(document, "steps"), errors.floor.value_or(std::nan(""))),
                            "Error after each accepted effect; dashed: noise floor");
  }
  const std::string robots =
      figures.place(plot_robots(gnuplot, part(document, "robots")), "Error per robot, largest first");
  // A full-width plot if there are many robots.
  const json& all_robots = part(document, "robots");
  const bool many = all_robots.is_array() && all_robots.size() > 24;
  if (!many) better += robots;
  if (!better.empty()) better = "<div class=\"grid\">" + better + "</div>\n";
  if (many) better += robots;
  page += section("better", "Improvement", better_lead(contract), better);
  page +=
      section("unexplained", "What is left unexplained", escaped(text(part(contract, "unexplained"), "in_words")),
              unexplained_body(part(contract, "unexplained"), figures));
  page += given_tables(part(document, "tables"));
  page += section("faults", "Faults of the data",
                  "Excluded before the fit. These are faults of the measurement, not properties of the robots.",
                  fault_list(contract));
  page += section(
      "maps", "Residual maps",
      "Residuals over the arena, before and after, on the same colour scale. A good model leaves no pattern.",
      maps(part(document, "maps"), figures));
  page += section("simulated", "Simulation check", simulated_lead(contract),
                  simulated_body(contract, document, figures));
  page += section("traced", "Residuals over covariates",
                  "Mean residuals with two standard errors. A good model leaves means near 0.",
                  covariate_section(contract, plots, figures));
  page += section("table", "Effects and their evidence", "", effects_table(contract));
  page += section("ambiguous", "Ambiguous effects", "", ambiguous_list(contract));
  page +=
      section("rejected", "Rejected hypotheses",
              "The most significant hypotheses that were not accepted. The thresholds correct for multiple tests.",
              rejected_table(contract));
  std::string model;
  for (const auto& [key, title] : {std::pair{"base", "Drive"}, {"noise", "Noise"}}) {
    const std::string table = figures_of(part(contract, key), part(contract, (std::string(key) + "_sd").c_str()));
    if (!table.empty()) model += fmt::format("<div><h3>{}</h3>{}</div>\n", title, table);
  }
  if (const std::string table = figures_of(part(document, "set")); !table.empty())
    model += "<div><h3>Data</h3>" + table + "</div>\n";
  page += section("model", "Base model and data", escaped(text(part(contract, "disc_centre"), "in_words")),
                  model.empty() ? "" : "<div class=\"thirds\">" + model + "</div>");
  return html::page("Kilotwin: identification report", figures.filled(std::move(page)));
}

void write_report(const json& document, const std::filesystem::path& file) {
  os::write_file(file, report_html(document));
}

}  // namespace kilotwin::identify

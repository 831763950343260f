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
#include "clients/identify/result/result_json.hpp"
#include "clients/report/html.hpp"
#include "clients/report/templates.hpp"
#include "core/os/files.hpp"
#include "core/stats/distributions.hpp"

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
    if (const auto spread = number(sd, key.c_str())) shown += " ± " + figure(stats::kNormal95 * *spread);
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

/// Further tables of the result, one section each.
void add_tables(const json& tables, Sections& sections) {
  for (const json& given : tables) {
    std::vector<std::string> heads;
    for (const json& head : part(given, "head")) heads.push_back(escaped(head.get<std::string>()));
    html::Table table(std::move(heads));
    for (const json& row : part(given, "rows")) {
      std::vector<std::string> cells;
      for (const json& cell : row) cells.push_back(escaped(cell.get<std::string>()));
      table.row(cells);
    }
    sections.add(text(given, "id"), text(given, "title"), escaped(text(given, "lead")), table.text());
  }
}

/// Errors over the horizon, after each effect, and by robot.
std::string improvement_plots(const json& document, Figures& figures) {
  const json &result = part(document, "result"), &robots = part(result, "robots");
  std::string out =
      figures.place(plot_horizon(figures.plots(), part(document, "horizon")), "Prediction error over the horizon");
  if (!part(result, "effects").empty())
    out += figures.place(
        plot_steps(figures.plots(), part(document, "steps"), errors_of(result).floor.value_or(std::nan(""))),
        "Error after each accepted effect; dashed: noise floor");
  const std::string by_robot =
      figures.place(plot_robots(figures.plots(), robots), "Error per robot, largest first");
  // A full-width plot if there are many robots.
  constexpr std::size_t kMany = 24;
  const bool many = robots.size() > kMany;
  if (!many) out += by_robot;
  if (!out.empty()) out = "<div class=\"grid\">" + out + "</div>\n";
  return many ? out + by_robot : out;
}

/// Fitted parameters, and what was measured.
std::string model_tables(const json& document) {
  const json& result = part(document, "result");
  std::string out;
  const auto add = [&](const char* title, const std::string& table) {
    if (!table.empty()) out += fmt::format("<div><h3>{}</h3>{}</div>\n", title, table);
  };
  add("Drive", figures_of(part(result, "base"), part(result, "base_sd")));
  add("Noise", figures_of(part(result, "noise")));
  add("Data", figures_of(part(document, "set")));
  return out.empty() ? "" : "<div class=\"thirds\">" + out + "</div>";
}

void add_sections(const json& document, Figures& figures, Sections& sections) {
  const json &result = part(document, "result"), &unexplained = part(result, "unexplained");
  sections.add("why", "Effects", "", cards(result, document, figures));
  sections.add("better", "Improvement", better_lead(result), improvement_plots(document, figures));
  sections.add("unexplained", "What is left unexplained", escaped(text(unexplained, "in_words")),
               unexplained_body(unexplained, figures));
  add_tables(part(document, "tables"), sections);
  sections.add("faults", "Faults of the data",
               "Excluded before the fit. These are faults of the measurement, not properties of the robots.",
               fault_list(result));
  sections.add(
      "maps", "Residual maps",
      "Residuals over the arena, before and after, on the same colour scale. A good model leaves no pattern.",
      maps(part(document, "maps"), figures));
  sections.add("simulated", "Simulation check", simulated_lead(result), simulated_body(result, document, figures));
  sections.add("traced", "Residuals over covariates",
               "Mean residuals with two standard errors. A good model leaves means near 0.",
               covariate_section(result, part(document, "covariate_plots"), figures));
  sections.add("table", "Effects and their evidence", "", effects_table(result));
  sections.add("ambiguous", "Ambiguous effects", "", ambiguous_list(result));
  sections.add("rejected", "Rejected hypotheses",
               "The most significant hypotheses that were not accepted. The thresholds correct for multiple tests.",
               rejected_table(result));
  sections.add("model", "Base model and data", escaped(text(part(result, "disc_centre"), "in_words")),
               model_tables(document));
}

}  // namespace

std::string report_html(const identification::Identification& found) {
  const json document = json_of(found);
  const json &result = part(document, "result"), &given = part(document, "bars");
  Gnuplot gnuplot;
  Figures figures(gnuplot);
  Sections sections;
  add_sections(document, figures, sections);
  html::Data page{html::Data::type::object};
  page.set("headline", found.has_headline() ? escaped(found.headline()) : headline(result));
  page.set("verdict", found.has_verdict() ? escaped(found.verdict()) : verdict(result));
  page.set("bars", given.empty() ? bars(result) : given_bars(given));
  page.set("sections", sections.all());
  return html::page("Kilotwin: identification report",
                    figures.filled(html::rendered(html::templates::kIdentification, page)));
}

void write_report(const identification::Identification& found, const std::filesystem::path& file) {
  os::write_file(file, report_html(found));
}

}  // namespace kilotwin::identify

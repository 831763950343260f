#include "clients/identify/report/report_simulated.hpp"

#include <fmt/format.h>

#include <cmath>

#include "clients/report/html.hpp"

namespace kilotwin::identify::report {
namespace {

using html::escaped;

/// A distance with its unit: "0.12 mm/s".
std::string with_unit(std::optional<double> value, const std::string& unit) {
  return unit.empty() || !value ? figure(value) : figure(value) + " " + escaped(unit);
}

std::string table_of(const json& simulated) {
  const json& statistics = part(simulated, "statistics");
  if (!statistics.is_array() || statistics.empty()) return "";
  html::Table table(
      {"statistic", "distance", "95 % under the null", "p value", "result", "distance of the base model"});
  for (const json& s : statistics) {
    const json& agrees = part(s, "agrees");
    const auto p = number(s, "p");
    table.row({escaped(text(s, "name")), with_unit(number(s, "distance"), text(s, "unit")),
               with_unit(number(s, "by_chance_95"), text(s, "unit")),
               chance(p ? std::optional(std::log10(std::max(*p, 1e-300))) : std::nullopt),
               !agrees.is_boolean() ? "too few robots"
               : agrees.get<bool>() ? "agrees"
                                    : "<b>differs</b>",
               with_unit(number(s, "base_distance"), text(s, "unit"))});
  }
  return table.text();
}

}  // namespace

std::string simulated_lead(const json& contract) {
  const json& simulated = part(contract, "simulated");
  std::string out =
      "An independent check: the simulator runs the written model. Robots start at the first measured poses and "
      "follow the recorded commands.";
  if (const auto seeds = number(simulated, "seeds")) {
    out += fmt::format(
        " {:.0f} simulations with the {} engine. Distances between histograms are 1-Wasserstein distances. "
        "Significance: a permutation test with labels permuted per {}. Speed and turn rate exclude contacts. "
        "<b>{}</b>",
        *seeds, escaped(text(simulated, "engine")), escaped(text(simulated, "unit")),
        escaped(text(simulated, "in_words")));
  }
  return out;
}

std::string simulated_body(const json& contract, const json& document, Figures& figures) {
  std::string plots;
  for (const json& distribution : part(document, "distributions"))
    plots += figures.place(plot_distribution(figures.plots(), distribution), "");
  plots += figures.place(plot_speed_over_time(figures.plots(), part(document, "speed_over_time")), "");
  plots += figures.place(plot_msd(figures.plots(), part(document, "msd")), "");
  return table_of(part(contract, "simulated")) + (plots.empty() ? "" : "<div class=\"grid\">" + plots + "</div>");
}

}  // namespace kilotwin::identify::report

#include "clients/identify/report/report_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "clients/report/html.hpp"
#include "clients/report/templates.hpp"

namespace kilotwin::identify::report {
namespace {

using html::escaped;

bool shares_covariate(const json& effect, const std::string& covariate) {
  static const std::map<std::string, std::set<std::string>> kOf = {
      {"position", {"x", "y", "radius", "position"}},
      {"motor_time", {"motor_time", "driven_time", "left_motor_time", "right_motor_time"}},
      {"neighbours", {"neighbours", "nearest", "density", "nearest_bearing", "bearing"}},
      {"history", {"previous_command", "last_turn", "place", "history"}}};
  for (const json& c : part(effect, "covariates")) {
    const std::string name = c.is_string() ? c.get<std::string>() : "";
    const auto of = kOf.find(name);
    if (name == covariate || (of != kOf.end() && of->second.contains(covariate))) return true;
  }
  return false;
}

/// Sum over a plot's bins of (mean / standard error)^2, and the number of bins.
std::pair<double, double> pattern_of(const json& plot, const char* when) {
  const json &mean = part(plot, when), &se = part(plot, "before_se");
  double sum = 0, bins = 0;
  for (std::size_t k = 0; mean.is_array() && se.is_array() && k < std::min(mean.size(), se.size()); ++k) {
    if (!mean[k].is_number() || !se[k].is_number() || !(se[k].get<double>() > 0)) continue;
    const double z = mean[k].get<double>() / se[k].get<double>();
    sum += z * z;
    bins += 1;
  }
  return {sum, bins};
}

/// Whether a plot shows the residuals of what an effect acts on. An effect on something that has no plot matches none;
/// results that do not say what effects act on match all.
bool shows_target(const json& effect, const json& plot) {
  const std::string acts_on = acts_on_of(effect), target = text(plot, "target");
  static const std::map<std::string, std::vector<std::string>> kOf = {{"forward", {"speed"}},
                                                                      {"turn", {"turn rate", "measured heading"}},
                                                                      {"world_x", {"drift", "measured position"}},
                                                                      {"world_y", {"drift", "measured position"}}};
  const auto of = kOf.find(target);
  return acts_on.empty() || of == kOf.end() ||
         std::any_of(of->second.begin(), of->second.end(),
                     [&](const std::string& word) { return acts_on.find(word) != std::string::npos; });
}

/// The plot that shows an effect best: over its covariate, of what it acts on, with the largest mean relative to
/// its standard error.
const json* plot_for(const json& effect, const json& plots) {
  const json* best = nullptr;
  double best_strength = -1;
  for (const json& plot : plots) {
    if (!shares_covariate(effect, text(plot, "covariate")) || !shows_target(effect, plot)) continue;
    const double strength = pattern_of(plot, "before").first;
    if (strength <= best_strength) continue;
    best = &plot;
    best_strength = strength;
  }
  return best;
}

}  // namespace

namespace {

/// The facts of an effect. Values are markup.
html::Data facts_of(const json& effect) {
  html::Data list{html::Data::type::list};
  const auto fact = [&](const std::string& name, const std::string& value) {
    html::Data one{html::Data::type::object};
    one.set("fact", name);
    one.set("value", value);
    list << one;
  };
  fact("acts on", acts_on_of(effect));
  if (const json& facts = part(effect, "facts"); facts.is_object()) {
    for (const auto& [name, value] : facts.items()) fact(name, escaped(value.get<std::string>()));
    return list;
  }
  if (const auto share = number(effect, "share_removed"))
    fact("removes", percent(share) + " of the mean square error");
  if (const auto without = number(effect, "rmse_without_mm"))
    fact("without it", "error " + figure(without) + " mm");
  const json& evidence = part(effect, "evidence");
  const auto family = number(evidence, "p_family");
  const auto log10_p = family ? std::log10(std::max(*family, 1e-300)) : number(evidence, "log10_p");
  if (log10_p) fact("p value", chance(log10_p));
  return list;
}

/// The fitted maps and curves of an effect, as markup.
std::string fitted_plots(const json& effect, const json& document, Figures& figures) {
  std::string plots;
  const std::string name = text(effect, "name");
  if (name.empty()) return plots;
  for (const json& map : part(document, "effect_maps")) {
    if (text(map, "name") == name)
      plots += figures.place(plot_effect_map(figures.plots(), map), "The fitted effect");
  }
  for (const json& curve : part(document, "effect_curves")) {
    if (text(curve, "name") == name)
      plots += figures.place(plot_effect(figures.plots(), curve), "The fitted effect");
  }
  return plots;
}

}  // namespace

std::string cards(const json& contract, const json& document, Figures& figures) {
  const json& covariate_plots = part(document, "covariate_plots");
  std::string out;
  std::set<const json*> shown;
  for (const json& effect : part(contract, "effects")) {
    std::string words = text(effect, "in_words");
    if (words.empty()) words = fmt::format("{} depends on {}.", acts_on_of(effect), covariates_of(effect));
    std::string plots = fitted_plots(effect, document, figures);
    const json* plot = covariate_plots.is_array() && plots.empty() ? plot_for(effect, covariate_plots) : nullptr;
    if (plot != nullptr && shown.insert(plot).second)
      plots = figures.place(plot_covariate(figures.plots(), *plot), "Residuals without the effect");
    html::Data card{html::Data::type::object};
    card.set("depends_on", covariates_of(effect));
    card.set("words", words);
    card.set("facts", facts_of(effect));
    card.set("plots", plots);
    out += html::rendered(html::templates::kEffect, card);
  }
  return out;
}

std::string effects_table(const json& contract) {
  const json& effects = part(contract, "effects");
  if (!effects.is_array() || effects.empty()) return "";
  html::Table table({"effect", "depends on", "acts on", "form", "p value", "gain in log-likelihood",
                     "held-out gain", "error without it, mm", "share of mean square error"});
  for (const json& effect : effects) {
    const json& evidence = part(effect, "evidence");
    const auto held = number(evidence, "held_out_gain"), se = number(evidence, "held_out_gain_se");
    const auto family = number(evidence, "p_family");
    table.row({escaped(text(effect, "name")), escaped(covariates_of(effect)), acts_on_of(effect),
               escaped(text(part(effect, "parameters"), "form")),
               chance(family ? std::log10(std::max(*family, 1e-300)) : number(evidence, "log10_p")),
               figure(number(evidence, "log_likelihood_gain")),
               held ? figure(held) + (se ? " ± " + figure(se) : "") : "–",
               figure(number(effect, "rmse_without_mm")), percent(number(effect, "share_removed"))});
  }
  return table.text();
}

std::string rejected_table(const json& contract) {
  const json& rejected = part(contract, "rejected");
  if (!rejected.is_array() || rejected.empty()) return "";
  const bool reasons =
      std::any_of(rejected.begin(), rejected.end(), [](const json& tried) { return !text(tried, "why").empty(); });
  std::vector<std::string> heads = {"hypothesis", "depends on", "acts on", "p value", "threshold"};
  if (reasons) heads.emplace_back("reason");
  html::Table table(std::move(heads));
  for (const json& tried : rejected) {
    const json& found = part(contract, "effects");
    const bool more = std::any_of(found.begin(), found.end(), [&](const json& effect) {
      return !text(effect, "name").empty() && text(effect, "name") == text(tried, "name");
    });
    std::vector<std::string> cells = {(more ? "further term of " : "") + escaped(text(tried, "name")),
                                      escaped(covariates_of(tried)), acts_on_of(tried),
                                      chance(number(tried, "log10_p")), chance(number(tried, "threshold_log10_p"))};
    if (reasons) cells.push_back(escaped(text(tried, "why")));
    table.row(cells);
  }
  return table.text();
}

std::string ambiguous_list(const json& contract) {
  std::string out;
  for (const json& pair : part(contract, "ambiguous")) {
    const std::string experiment = text(pair, "experiment");
    out += fmt::format("<li>Accepted: <b>{}</b>. Alternative: <b>{}</b> (log-likelihood {} lower).{}</li>\n",
                       escaped(text(pair, "found")), escaped(text(pair, "instead")),
                       figure(number(pair, "log_likelihood_difference")),
                       experiment.empty() ? "" : " To separate them: " + escaped(experiment) + ".");
  }
  return out.empty() ? "" : "<ul>" + out + "</ul>\n";
}

std::string covariate_section(const json& contract, const json& covariate_plots, Figures& figures) {
  if (!covariate_plots.is_array()) return "";
  const json& effects = part(contract, "effects");
  // Strongest first. Weaker plots show no pattern.
  constexpr double kPattern = 4;
  constexpr std::size_t kMostShown = 8;
  std::vector<std::pair<double, const json*>> order;
  for (const json& plot : covariate_plots) {
    const auto [before, bins] = pattern_of(plot, "before");
    const double after = pattern_of(plot, "after").first;
    if (bins < 2) continue;
    const bool found = std::any_of(effects.begin(), effects.end(),
                                   [&](const json& e) { return shares_covariate(e, text(plot, "covariate")); });
    order.emplace_back(std::max(before, after) / bins * (found ? 10 : 1), &plot);
  }
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string shown, folded;
  std::size_t count = 0;
  for (const auto& [strength, plot] : order) {
    const std::string markup = figures.place(plot_covariate(figures.plots(), *plot), "");
    if (markup.empty()) continue;
    const bool show = count < kMostShown && (strength > kPattern || count < 2);
    (show ? shown : folded) += markup;
    if (show) ++count;
  }
  std::string out = shown.empty() ? "" : "<div class=\"grid\">" + shown + "</div>\n";
  if (!folded.empty())
    out += "<details><summary>Other covariates</summary><div class=\"grid\">" + folded + "</div></details>\n";
  return out;
}

}  // namespace kilotwin::identify::report

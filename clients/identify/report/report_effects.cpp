#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "clients/identify/report/report_sections.hpp"

namespace kilotwin::identify::report {
namespace {

using identification::CovariatePlot, identification::Effect;
using Plots = google::protobuf::RepeatedPtrField<CovariatePlot>;

bool shares_covariate(const Effect& effect, const std::string& covariate) {
  static const std::map<std::string, std::set<std::string>> kOf = {
      {"position", {"x", "y", "radius", "position"}},
      {"motor_time", {"motor_time", "driven_time", "left_motor_time", "right_motor_time"}},
      {"neighbours", {"neighbours", "nearest", "density", "nearest_bearing", "bearing"}},
      {"history", {"previous_command", "last_turn", "place", "history"}}};
  return std::any_of(effect.covariates().begin(), effect.covariates().end(), [&](const std::string& name) {
    const auto of = kOf.find(name);
    return name == covariate || (of != kOf.end() && of->second.contains(covariate));
  });
}

/// Sum over a plot's bins of (mean / standard error)^2, and the number of bins.
std::pair<double, double> pattern_of(const google::protobuf::RepeatedField<double>& mean,
                                     const google::protobuf::RepeatedField<double>& se) {
  double sum = 0, bins = 0;
  for (int k = 0; k < std::min(mean.size(), se.size()); ++k) {
    const double z = mean[k] / se[k];
    if (!(se[k] > 0) || !std::isfinite(z)) continue;
    sum += z * z;
    bins += 1;
  }
  return {sum, bins};
}

/// Whether a plot shows the residuals of what an effect acts on. An effect on something that has no plot matches none;
/// results that do not say what effects act on match all.
bool shows_target(const Effect& effect, const CovariatePlot& plot) {
  static const std::map<std::string, std::vector<std::string>> kOf = {{"forward", {"speed"}},
                                                                      {"turn", {"turn rate", "measured heading"}},
                                                                      {"world_x", {"drift", "measured position"}},
                                                                      {"world_y", {"drift", "measured position"}}};
  const std::string acts_on = acts_on_in_words(effect.acts_on());
  const auto of = kOf.find(plot.target());
  return acts_on.empty() || of == kOf.end() ||
         std::any_of(of->second.begin(), of->second.end(),
                     [&](const std::string& word) { return acts_on.find(word) != std::string::npos; });
}

/// The plot that shows an effect best: over its covariate, of what it acts on, with the largest mean relative to
/// its standard error.
const CovariatePlot* plot_for(const Effect& effect, const Plots& plots) {
  const CovariatePlot* best = nullptr;
  double best_strength = -1;
  for (const CovariatePlot& plot : plots) {
    if (!shares_covariate(effect, plot.covariate()) || !shows_target(effect, plot)) continue;
    const double strength = pattern_of(plot.before(), plot.before_se()).first;
    if (strength <= best_strength) continue;
    best = &plot;
    best_strength = strength;
  }
  return best;
}

std::optional<double> log10_p_of(const identification::Evidence& evidence) {
  if (evidence.has_p_family()) return log10_of(evidence.p_family());
  return known(evidence.has_log10_p(), evidence.log10_p());
}

/// "41.2 mm (39.8 to 42.6, 95 %)".
std::string with_interval(const identification::Estimate& number) {
  const auto end = [](bool has, double value, const char* none) { return has ? figure(value) : std::string(none); };
  return fmt::format("{}{}{} ({} to {}, 95 %)", figure(number.value()), number.unit().empty() ? "" : " ",
                     number.unit(), end(number.has_low(), number.low(), "not bounded"),
                     end(number.has_high(), number.high(), "not bounded"));
}

Data facts_of(const Effect& effect) {
  Data list{Data::type::list};
  const auto fact = [&](const std::string& name, const std::string& value) {
    Data one{Data::type::object};
    one.set("fact", name);
    one.set("value", value);
    list << one;
  };
  fact("acts on", acts_on_in_words(effect.acts_on()));
  // Amplitudes of many robots would hide the rest. They are in the result.
  constexpr int kMostNumbers = 12;
  for (int i = 0; i < std::min(effect.numbers_size(), kMostNumbers); ++i)
    fact(effect.numbers(i).name(), with_interval(effect.numbers(i)));
  if (effect.has_facts()) {
    const std::map<std::string, google::protobuf::Value> given(effect.facts().fields().begin(),
                                                               effect.facts().fields().end());
    for (const auto& [name, value] : given) fact(name, value.string_value());
    return list;
  }
  if (const auto share = number(effect.share_removed()))
    fact("removes", percent(share) + " of the mean square error");
  if (const auto without = number(effect.rmse_without_mm())) fact("without it", "error " + figure(without) + " mm");
  if (const auto log10_p = log10_p_of(effect.evidence())) fact("p value", chance(log10_p));
  return list;
}

/// Adds the fitted maps and curves of an effect. Returns whether there are any.
bool add_fitted(Data& figures, const Effect& effect, const Identification& found, Figures& drawn) {
  if (effect.name().empty()) return false;
  const std::size_t before = drawn.plots().size();
  for (const identification::EffectMap& map : found.effect_maps()) {
    if (map.name() == effect.name())
      drawn.place(figures, plot_effect_map(drawn.plots(), map),
                  map.low().empty() ? "The fitted effect" : "The fitted effect. Crosses: the 95 % band holds zero");
  }
  for (const identification::EffectCurve& curve : found.effect_curves()) {
    if (curve.name() == effect.name())
      drawn.place(figures, plot_effect(drawn.plots(), curve),
                  curve.low().empty() ? "The fitted effect" : "The fitted effect with its 95 % band");
  }
  return drawn.plots().size() > before;
}

/// "12.3 ± 4.5".
std::string with_se(const google::protobuf::Value& value, const google::protobuf::Value& se) {
  const auto known_value = number(value), known_se = number(se);
  return known_value && known_se ? figure(known_value) + " ± " + figure(known_se) : figure(known_value);
}

}  // namespace

Section effects_section(const Identification& found, Figures& drawn) {
  Data cards{Data::type::list};
  std::set<const CovariatePlot*> shown;
  for (const Effect& effect : found.result().effects()) {
    Data card{Data::type::object}, figures{Data::type::list};
    const std::string covariates = covariates_of(effect.covariates());
    if (!add_fitted(figures, effect, found, drawn)) {
      const CovariatePlot* plot = plot_for(effect, found.covariate_plots());
      if (plot != nullptr && shown.insert(plot).second)
        drawn.place(figures, plot_covariate(drawn.plots(), *plot), "Residuals without the effect");
    }
    card.set("depends_on", covariates);
    card.set("words", !effect.in_words().empty()
                          ? effect.in_words()
                          : fmt::format("{} depends on {}.", acts_on_in_words(effect.acts_on()), covariates));
    card.set("facts", facts_of(effect));
    card.set("figures", figures);
    cards << card;
  }
  if (cards.is_empty_list()) return std::nullopt;
  return Data{"cards", cards};
}

Section evidence_section(const Result& result) {
  if (result.effects().empty()) return std::nullopt;
  std::vector<std::vector<std::string>> rows;
  for (const Effect& effect : result.effects()) {
    const identification::Evidence& evidence = effect.evidence();
    const auto& parameters = effect.parameters().fields();
    const auto form = parameters.find("form");
    rows.push_back({effect.name(), covariates_of(effect.covariates()), acts_on_in_words(effect.acts_on()),
                    form == parameters.end() ? "" : form->second.string_value(), chance(log10_p_of(evidence)),
                    figure(known(evidence.has_log_likelihood_gain(), evidence.log_likelihood_gain())),
                    with_se(evidence.held_out_gain(), evidence.held_out_gain_se()),
                    figure(number(effect.rmse_without_mm())), percent(number(effect.share_removed()))});
  }
  return Data{"table", table_of({"effect", "depends on", "acts on", "form", "p value", "gain in log-likelihood",
                                 "held-out gain", "error without it, mm", "share of mean square error"},
                                rows)};
}

Section rejected_section(const Result& result) {
  const auto& rejected = result.rejected();
  if (rejected.empty()) return std::nullopt;
  const bool reasons =
      std::any_of(rejected.begin(), rejected.end(), [](const auto& tried) { return !tried.why().empty(); });
  std::vector<std::string> heads = {"hypothesis", "depends on", "acts on", "p value", "threshold"};
  if (reasons) heads.emplace_back("reason");
  std::vector<std::vector<std::string>> rows;
  for (const identification::Rejected& tried : rejected) {
    const bool more = std::any_of(result.effects().begin(), result.effects().end(), [&](const Effect& effect) {
      return !effect.name().empty() && effect.name() == tried.name();
    });
    rows.push_back({(more ? "further term of " : "") + tried.name(), covariates_of(tried.covariates()),
                    acts_on_in_words(tried.acts_on()), chance(known(tried.has_log10_p(), tried.log10_p())),
                    chance(known(tried.has_threshold_log10_p(), tried.threshold_log10_p()))});
    if (reasons) rows.back().push_back(tried.why());
  }
  return Data{"table", table_of(heads, rows)};
}

Section ambiguous_section(const Result& result) {
  Data pairs{Data::type::list};
  for (const identification::Ambiguous& pair : result.ambiguous()) {
    Data one{Data::type::object};
    one.set("accepted", pair.found());
    one.set("alternative", pair.instead());
    one.set("lower", figure(known(pair.has_log_likelihood_difference(), pair.log_likelihood_difference())));
    set_text(one, "experiment", pair.experiment());
    pairs << one;
  }
  if (pairs.is_empty_list()) return std::nullopt;
  return Data{"pairs", pairs};
}

Section covariate_section(const Identification& found, Figures& drawn) {
  // Strongest first. Weaker plots show no pattern.
  constexpr double kPattern = 4;
  constexpr std::size_t kMostShown = 8;
  std::vector<std::pair<double, const CovariatePlot*>> order;
  const auto& effects = found.result().effects();
  for (const CovariatePlot& plot : found.covariate_plots()) {
    const auto [before, bins] = pattern_of(plot.before(), plot.before_se());
    const double after = pattern_of(plot.after(), plot.before_se()).first;
    if (bins < 2) continue;
    const bool of_effect = std::any_of(effects.begin(), effects.end(),
                                       [&](const Effect& e) { return shares_covariate(e, plot.covariate()); });
    order.emplace_back(std::max(before, after) / bins * (of_effect ? 10 : 1), &plot);
  }
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  Data shown{Data::type::list}, folded{Data::type::list};
  std::size_t count = 0;
  for (const auto& [strength, plot] : order) {
    const PlotNumber number = plot_covariate(drawn.plots(), *plot);
    const bool show = count < kMostShown && (strength > kPattern || count < 2);
    drawn.place(show ? shown : folded, number, "");
    if (show && number) ++count;
  }
  if (shown.is_empty_list() && folded.is_empty_list()) return std::nullopt;
  Data section{Data::type::object};
  section.set("figures", shown);
  if (!folded.is_empty_list()) section.set("folded", Data{"figures", folded});
  return section;
}

}  // namespace kilotwin::identify::report

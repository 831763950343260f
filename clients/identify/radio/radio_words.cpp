#include "clients/identify/radio/radio_words.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "clients/identify/result/values.hpp"

namespace kilotwin::radio_fit {
namespace {

using identification::RadioErrors, identification::RadioStep;
using identify::json_list, identify::json_value;

/// Mean over the sets of one error of a step, in absolute value.
double mean_of(const RadioStep& step, double (RadioErrors::*error)() const) {
  double sum = 0;
  // By name: the order of additions is that of the sets.
  for (const auto& [set, errors] : std::map(step.errors().begin(), step.errors().end()))
    sum += std::abs((errors.*error)());
  return step.errors().empty() ? 0 : sum / static_cast<double>(step.errors().size());
}

identification::Accuracy accuracy_of(const RadioStep& step) {
  identification::Accuracy out;
  out.set_deficit(mean_of(step, &RadioErrors::deficit));
  out.set_sent_error(mean_of(step, &RadioErrors::sent_error));
  out.set_near_worst(mean_of(step, &RadioErrors::near_worst));
  out.set_far_worst(mean_of(step, &RadioErrors::far_worst));
  out.set_silent_error(mean_of(step, &RadioErrors::silent_error));
  out.set_run_spread_error(mean_of(step, &RadioErrors::run_spread_error));
  return out;
}

std::string figure(double value) { return fmt::format("{:.3f}", value); }

/// Errors of each step on held-out runs, by set.
identification::Table table_of_errors(const identification::RadioFit& fit) {
  identification::Table table;
  table.set_id("errors");
  table.set_title("Errors on held-out runs, effect by effect");
  table.set_lead(
      "Sent: messages per robot, simulated minus measured. Near, far: largest error of the reception share, up to "
      "105 mm and beyond 125 mm. Silent: error of the share of pairs without reception. Runs: error of the "
      "standard deviation between runs. Deficit: log-likelihood of the counts below that of the training runs' "
      "means, per pair and run.");
  identify::assign(table.mutable_head(),
                   std::array{"with", "set", "sent", "near", "far", "silent", "runs", "deficit, nat"});
  for (const RadioStep& step : fit.effects()) {
    for (const auto& [set, e] : std::map(step.errors().begin(), step.errors().end()))
      *table.add_rows() = json_list(std::array{
          step.name(), set, fmt::format("{:+.1f}", e.sent_error()), figure(e.near_worst()), figure(e.far_worst()),
          figure(e.silent_error()), figure(e.run_spread_error()), figure(e.deficit())});
  }
  return table;
}

/// Predictive check on new robots: does the measured set look like a sample of the fitted population?
identification::Table table_of_population(const identification::RadioFit& fit) {
  identification::Table table;
  table.set_id("population");
  table.set_title("Predictive check: new robots");
  table.set_lead(
      "Reception share over distance: measured on held-out runs, and simulated for random swarms of the fitted "
      "population.");
  identify::assign(table.mutable_head(),
                   std::array{"set", "distance, mm", "measured", "median swarm", "95 % of swarms"});
  for (const identification::PopulationClass& c : fit.population())
    *table.add_rows() = json_list(
        std::array{c.set(), fmt::format("{:.0f}", c.distance_mm()), figure(c.measured()), figure(c.median()),
                   fmt::format("{:.2f} to {:.2f}{}", c.low(), c.high(), c.inside() ? "" : ", outside")});
  return table;
}

/// Numbers of the population with their 95 % intervals.
identification::Table table_of_numbers(const identification::RadioFit& fit) {
  identification::Table table;
  table.set_id("numbers");
  table.set_title("Numbers of the population");
  table.set_lead(
      "Of the model for robots like these. Range and pattern are told apart by their priors where bearings are "
      "few.");
  identify::assign(table.mutable_head(), std::array{"number", "value", "95 % interval", "by"});
  for (const identification::Estimate& number : fit.shared().numbers())
    *table.add_rows() = json_list(std::array{
        number.name(), fmt::format("{:.2f} {}", number.value(), number.unit()),
        number.has_high() ? fmt::format("{:.2f} to {:.2f} {}", number.low(), number.high(), number.unit()) : "",
        number.how()});
  return table;
}

/// An effect with its gain over the step before it.
identification::Effect effect_of(const RadioStep& step, const RadioStep& before) {
  const double deficit_before = mean_of(before, &RadioErrors::deficit),
               deficit = mean_of(step, &RadioErrors::deficit);
  identification::Effect effect;
  effect.set_name(step.name());
  *effect.mutable_covariates() = step.covariates();
  effect.set_acts_on(step.acts_on());
  *effect.mutable_evidence() = step.evidence();
  (*effect.mutable_parameters()->mutable_fields())["added"] = json_value(step.parameters().added());
  effect.set_deficit_before(deficit_before);
  effect.set_deficit_after(deficit);
  auto& facts = *effect.mutable_facts()->mutable_fields();
  facts["deficit"] = json_value(fmt::format("{:.3f} nat before, {:.3f} nat with it", deficit_before, deficit));
  if (!step.evidence().what().empty()) facts["evidence"] = json_value(step.evidence().what());
  effect.set_in_words(fmt::format("{}: {}", step.name(), step.parameters().added()));
  return effect;
}

identification::Result result_of(const identification::RadioFit& fit) {
  identification::Result result;
  *result.mutable_before() = accuracy_of(fit.effects(0));
  *result.mutable_after() = accuracy_of(*fit.effects().rbegin());
  // The first step is the ARGoS model.
  for (int s = 1; s < fit.effects_size(); ++s)
    *result.add_effects() = effect_of(fit.effects(s), fit.effects(s - 1));
  *result.mutable_fitted_runs_themselves() = fit.fitted_runs_themselves();
  *result.mutable_shared() = fit.shared();
  *result.mutable_of_each_set() = fit.of_each_set();
  *result.mutable_measured_sent() = fit.measured_sent();
  *result.mutable_population() = fit.population();
  return result;
}

/// Texts and bars of the page in place of trajectory errors.
void add_words(identification::Identification& found) {
  const identification::Accuracy &before = found.result().before(), &after = found.result().after();
  const std::string verdict = fmt::format(
      "On held-out runs, the log-likelihood of the counts is {:.2f} nat per pair and run below that of the "
      "training runs' means in the ARGoS paper's model, and {:.2f} nat below with all effects. The largest error "
      "of "
      "the reception share is {:.3f} up to 105 mm ({:.3f} before) and {:.3f} beyond 125 mm ({:.3f} before).",
      before.deficit(), after.deficit(), after.near_worst(), before.near_worst(), after.far_worst(),
      before.far_worst());
  found.set_headline("Radio model of these robots");
  found.set_verdict(verdict);
  found.add_summary(verdict);
  const auto add_bar = [&](const char* kind, const char* name, double value) {
    identification::Bar& bar = *found.add_bars();
    bar.set_kind(kind);
    bar.set_name(name);
    bar.set_value(value);
    bar.set_unit("nat");
  };
  add_bar("before", "the ARGoS paper's model", before.deficit());
  add_bar("after", "with effects", after.deficit());
}

}  // namespace

identify::Identified identified_of(const identification::RadioFit& fit, proto::Model model) {
  identify::Identified out;
  out.model = std::move(model);
  *out.found.mutable_result() = result_of(fit);
  add_words(out.found);
  *out.found.add_tables() = table_of_errors(fit);
  *out.found.add_tables() = table_of_numbers(fit);
  *out.found.add_tables() = table_of_population(fit);
  out.found.mutable_set()->set_has_headings(false);
  out.found.mutable_set()->set_has_commands(false);
  return out;
}

}  // namespace kilotwin::radio_fit

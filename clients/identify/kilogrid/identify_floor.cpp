#include "clients/identify/kilogrid/identify_floor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "clients/identify/kilogrid/floor_plots.hpp"
#include "clients/identify/kilogrid/floor_search.hpp"
#include "clients/identify/kilogrid/floor_validation.hpp"
#include "core/base/error.hpp"

namespace kilotwin::kilogrid {
namespace {

using identify::Identified, identify::Options;
using nlohmann::json;

std::string words_of(const FloorModel& model, std::size_t term) {
  const double* v = model.values.data() + model.first_of(term);
  std::array<double, 3> of{};
  std::copy_n(v, std::min(of.size(), model.terms[term].parameters.size()), of.begin());
  return fmt::format(fmt::runtime(model.terms[term].about), of[0], of[1], of[2]);
}

std::string words_of_wall(const FloorModel& model) {
  const auto& wall = *model.wall;
  const auto [slowest, fastest] = std::minmax_element(wall.begin(), wall.end());
  return fmt::format(
      "within {:.0f} mm of a wall robots drive at {:.2f} to {:.2f} of their speed, depending on the boundary "
      "section",
      FloorModel::kBeside_mm, *slowest, *fastest);
}

/// The model without one of its effects: terms first, the walls last.
FloorModel without(const FloorModel& model, std::size_t effect) {
  if (effect + 1 < model.terms.size()) return model.without(effect + 1);
  FloorModel less = model;
  less.wall.reset();
  return less;
}
std::size_t effects_of(const FloorModel& model) { return model.terms.size() - 1 + (model.wall ? 1 : 0); }
std::string name_of(const FloorModel& model, std::size_t effect) {
  return effect + 1 < model.terms.size() ? model.terms[effect + 1].name : kWallEffect;
}

std::vector<std::string> covariates_of(const FloorModel& model, std::size_t effect) {
  return effect + 1 < model.terms.size() ? model.terms[effect + 1].covariates
                                         : std::vector<std::string>{"position"};
}

json faults_of(const std::vector<FloorRun>& train, const std::vector<FloorRun>& test) {
  json faults = json::array();
  for (const auto* set : {&train, &test}) {
    for (const FloorRun& run : *set) {
      for (const FloorFault& fault : run.faults) {
        faults.push_back({{"kind", fault.reason.starts_with("in two") ? "duplicated" : "silent"},
                          {"run", run.name},
                          {"robot", fault.robot},
                          {"in_words", fmt::format("{}, robot {}: {}", run.name, fault.robot, fault.reason)}});
      }
    }
  }
  return faults;
}

/// Texts of the report in place of trajectory errors.
void add_words(json& document, const json& classifier) {
  const auto area = [&](const char* of, const char* what) { return classifier.at(of).at(what).get<double>(); };
  const auto bar = [&](const char* kind, const char* name, const char* of) {
    return json{{"kind", kind},
                {"name", name},
                {"value", area(of, "area")},
                {"low", area(of, "low")},
                {"high", area(of, "high")},
                {"unit", ""},
                {"from", 0.5}};
  };
  document["bars"] = {bar("before", "base model", "before"), bar("after", "with effects", "after"),
                      bar("floor", "measured days", "measured_days")};
  document["verdict"] = fmt::format(
      "Classifier two-sample test: measured (held-out days) against simulated windows of 200 s. The area under the "
      "ROC curve is 0.5 at chance level. It is {:.3f} for the base model and, for the model with "
      "effects "
      "with {:.3f} ({:.3f} to {:.3f}). Measured days against each other: {:.3f}.",
      area("before", "area"), area("after", "area"), area("after", "low"), area("after", "high"),
      area("measured_days", "area"));
  document["summary"] = {
      fmt::format("area under the ROC curve, simulated against measured held-out runs: {:.3f} before, {:.3f} after "
                  "({:.3f} to {:.3f}); measured days against each other {:.3f}",
                  area("before", "area"), area("after", "area"), area("after", "low"), area("after", "high"),
                  area("measured_days", "area"))};
  json rows = json::array();
  for (const json& feature : classifier.at("features"))
    rows.push_back({feature.at("name"), fmt::format("{:.3f}", feature.at("before").get<double>()),
                    fmt::format("{:.3f}", feature.at("after").get<double>())});
  document["tables"].push_back({{"id", "features"},
                                {"title", "Differences between simulated and measured robots"},
                                {"lead",
                                 "Area under the ROC curve of each single feature on held-out runs: 0.5 is chance "
                                 "level. Above it, the feature "
                                 "is larger in simulated runs, below it smaller."},
                                {"head", {"feature of 200 s", "base model", "with effects"}},
                                {"rows", rows}});
}

}  // namespace

Identified identify_floor(std::vector<FloorRun> train, std::vector<FloorRun> test, const Options& options) {
  const auto started = std::chrono::steady_clock::now();
  if (test.empty()) {
    std::vector<FloorRun> kept;
    for (std::size_t r = 0; r < train.size(); ++r)
      (train.size() > 1 && r % 3 == 1 ? test : kept).push_back(std::move(train[r]));
    train = std::move(kept);
  }
  if (train.empty() || test.empty() || train.front().tracks.empty())
    throw UserError("one run cannot be held out; give at least two runs, or --test DIR");
  double part = 0;
  const FloorProgress progress = [&](const std::string& what) {
    if (options.progress) options.progress(part, what);
  };
  const Floor floor;
  // An unlike day is reported and excluded from the fit: its conditions need not recur.
  std::vector<FloorRun> alike, unlike;
  json faults = faults_of(train, test);
  const std::vector<UnlikeRun> unlikes = unlike_runs(train, floor);
  for (std::size_t r = 0; r < train.size(); ++r) {
    const auto is = std::find_if(unlikes.begin(), unlikes.end(), [&](const UnlikeRun& u) { return u.run == r; });
    (is == unlikes.end() ? alike : unlike).push_back(train[r]);
    if (is == unlikes.end()) continue;
    faults.push_back(
        {{"kind", "unlike"},
         {"run", train[r].name},
         {"in_words", fmt::format("{}: the robots behaved differently from those of the other runs ({}: {:.3g} "
                                  "against {:.3g}); the run is excluded from the fit",
                                  train[r].name, is->worst, is->value, is->others)}});
    progress(fmt::format("{} is unlike the other runs", train[r].name));
  }
  const FloorTarget learned(alike, floor, options.threads), held_out(test, floor, options.threads);
  json steps = json::array();
  const auto note = [&](const std::string& added, const FloorModel& model) {
    const double misfit = held_out.misfit(simulated_statistics(held_out, model.settings(), 4711));
    steps.push_back({{"added", added}, {"held_out_misfit", misfit}});
    progress(fmt::format("{}: misfit on held-out runs {:.0f}, {} statistics", added, misfit, held_out.size()));
  };

  FloorModel model;
  model.add(base_term());
  part = 0.02;
  fit_from_far_start(model, learned, 1, progress);
  fit(model, learned, 2, 1, 1, progress);
  const FloorModel base = model;
  note("base", model);

  json effects = json::array(), rejected = json::array(), ambiguous = json::array();
  std::vector<EffectGain> gains;
  if (options.find_effects) {
    const double from = 0.15, to = 0.85;
    FloorFound found = search_effects(
        base, learned, candidate_terms(floor),
        [&](double done, const std::string& what) {
          part = from + (to - from) * done;
          progress(what);
        },
        note);
    model = std::move(found.model);
    gains = std::move(found.gains);
    for (const RejectedEffect& effect : found.rejected)
      rejected.push_back({{"name", effect.gain.name},
                          {"covariates", effect.covariates},
                          {"acts_on", effect.acts_on},
                          {"misfit_gain", effect.gain.gain},
                          {"misfit_gain_needed", effect.gain.needed},
                          {"why", effect.why}});
  }

  part = 0.85;
  progress("predictions");
  std::vector<Predicted> by_base, by_model;
  const Validation before = validate(test, floor, base.settings(), options.horizon_s, &by_base),
                   after = validate(test, floor, model.settings(), options.horizon_s, &by_model);
  const FloorStatistics out_before = simulated_statistics(held_out, base.settings(), 78, 2),
                        out_after = simulated_statistics(held_out, model.settings(), 79, 2);
  const double misfit_before = held_out.misfit(out_before), misfit_after = held_out.misfit(out_after);
  for (std::size_t e = 0; e < effects_of(model); ++e) {
    const FloorModel less = without(model, e);
    const bool is_wall = name_of(model, e) == kWallEffect;
    const double misfit = held_out.misfit(simulated_statistics(held_out, less.settings(), 79));
    const Validation lesser = validate(test, floor, less.settings(), options.horizon_s, nullptr);
    json parameters;
    if (is_wall) {
      parameters = {{"form", "steps"}, {"beside_mm", FloorModel::kBeside_mm}, {"part_of_speed", *model.wall}};
    } else {
      parameters["form"] = "record of the model";
      for (std::size_t p = 0; p < model.terms[e + 1].parameters.size(); ++p)
        parameters[model.terms[e + 1].parameters[p].name] = model.values[model.first_of(e + 1) + p];
      if (!model.terms[e + 1].experiment.empty())
        ambiguous.push_back({{"found", name_of(model, e)},
                             {"instead", "see experiment"},
                             {"experiment", model.terms[e + 1].experiment}});
    }
    effects.push_back(
        {{"name", name_of(model, e)},
         {"covariates", covariates_of(model, e)},
         {"acts_on", is_wall ? "WHEEL_GAIN" : model.terms[e + 1].acts_on},
         {"evidence",
          {{"misfit_gain", gains[e].gain},
           {"misfit_gain_needed", gains[e].needed},
           {"held_out_misfit_without", misfit},
           {"held_out_misfit", misfit_after},
           {"log_likelihood_gain", after.log_likelihood - lesser.log_likelihood}}},
         {"parameters", parameters},
         {"rmse_without_mm", lesser.rmse_mm()},
         {"share_removed", (misfit - misfit_after) / std::max(misfit_before - misfit_after, 1e-9)},
         {"facts",
          {{"misfit of training runs",
            fmt::format("lowered by {:.0f}; significance bound {:.0f}", gains[e].gain, gains[e].needed)},
           {"misfit on held-out runs", fmt::format("{:.0f} without it, {:.0f} with it", misfit, misfit_after)},
           {"cells 10 s ahead",
            fmt::format("{:.1f} mm without it, {:.1f} mm with it", lesser.rmse_mm(), after.rmse_mm())},
           {"likelihood of cells", fmt::format("{:+.0f} nat with it, for single-robot filters",
                                               after.log_likelihood - lesser.log_likelihood)}}},
         {"in_words", is_wall ? words_of_wall(model) : words_of(model, e + 1)}});
    progress(fmt::format("{}: misfit {:.0f} without it, {:.0f} with it", name_of(model, e), misfit, misfit_after));
  }
  if (model.wall)
    ambiguous.push_back(
        {{"found", kWallEffect},
         {"instead", "boundary messages that make robots turn away for longer in some places"},
         {"experiment", "let robots drive along the wall with the boundary messages switched off"}});
  std::stable_sort(effects.begin(), effects.end(),
                   [](const json& a, const json& b) { return a["share_removed"] > b["share_removed"]; });

  part = 0.95;
  progress("classifier");
  json statistics = json::array();
  for (const StatisticGroup& group : statistic_groups()) {
    const bool root = group.name == "msd";
    std::vector<double> sd(statistic_count());
    for (std::size_t s = 0; s < sd.size(); ++s) sd[s] = std::sqrt(held_out.tolerance()[s]);
    statistics.push_back({{"name", group.name},
                          {"covariate", group.covariate},
                          {"labels", group.labels},
                          {"measured", numbers(held_out.statistics().value, group, root)},
                          {"tolerance", root ? json() : numbers(sd, group, false)},
                          {"before", numbers(out_before.value, group, root)},
                          {"after", numbers(out_after.value, group, root)},
                          {"misfit_before", held_out.misfit(out_before, group)},
                          {"misfit_after", held_out.misfit(out_after, group)}});
  }
  Identified result;
  const FloorSettings settings = model.settings();
  result.model = settings.model;
  for (std::size_t i = 0; i < std::min(by_base.size(), by_model.size()); ++i) {
    const Predicted &b = by_base[i], &a = by_model[i];
    result.predictions.push_back({b.run, b.robot, b.at.time_s, b.at.x_mm, b.at.y_mm, a.at.x_mm, a.at.y_mm});
  }
  json summary_before = summary_of(before), summary_after = summary_of(after);
  summary_before["misfit"] = misfit_before;
  summary_after["misfit"] = misfit_after;
  json& contract = result.document["contract"];
  contract = {
      {"before", summary_before},
      {"after", summary_after},
      {"noise_floor_mm", cell_noise_mm(floor, settings.radio)},
      {"noise_floor_how",
       "root mean square distance between robots and the centres of the cells that report them: the error of "
       "exactly known positions"},
      {"horizon_s", options.horizon_s},
      {"effects", effects},
      {"rejected", rejected},
      {"ambiguous", ambiguous},
      {"faults", faults},
      {"statistics", statistics},
      {"classifier", classify(alike, unlike, test, held_out, base.settings(), settings)}};
  result.document["tables"] = {table_of_motion(held_out, out_before, out_after)};
  add_words(result.document, contract.at("classifier"));
  const auto parameters = base_term().parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    contract[p < 4 ? "base" : "floor"][parameters[p].name] = model.values[p];
  contract["floor"]["cell_later"] = settings.radio.later;
  result.document["set"] = {
      {"train", train.size()}, {"test", test.size()}, {"has_headings", false}, {"has_commands", false}};
  result.document["steps"] = steps;
  add_plots(result.document, held_out, out_before, out_after);
  result.document["robots"] = json::array();
  result.document["seconds"]["all"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  part = 1;
  progress("done");
  return result;
}

}  // namespace kilotwin::kilogrid

#include "clients/identify/kilogrid/identify_floor.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "clients/identify/kilogrid/floor_plots.hpp"
#include "clients/identify/kilogrid/floor_protocol.hpp"
#include "clients/identify/kilogrid/floor_search.hpp"
#include "clients/identify/kilogrid/floor_validation.hpp"
#include "clients/identify/result/values.hpp"
#include "core/base/error.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::kilogrid {
namespace {

using identify::Identified, identify::Options, identify::Study, identify::assign;
using JsonFields = google::protobuf::Map<std::string, identify::JsonValue>;
using identify::json_list, identify::json_null, identify::json_value;

/// Of the simulations that give standard errors.
constexpr std::uint64_t kErrorsSeed = 500;

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

std::vector<std::string> names_of(const FloorModel& model) {
  std::vector<std::string> names;
  for (std::size_t e = 0; e < effects_of(model); ++e) names.push_back(name_of(model, e));
  return names;
}

std::vector<std::string> covariates_of(const FloorModel& model, std::size_t effect) {
  return effect + 1 < model.terms.size() ? model.terms[effect + 1].covariates
                                         : std::vector<std::string>{"position"};
}

void add_faults(identification::Result& result, const std::vector<FloorRun>& runs) {
  for (const FloorRun& run : runs) {
    for (const FloorFault& found : run.faults) {
      identification::Fault& fault = *result.add_faults();
      fault.set_kind(found.kind == FloorFault::Kind::kTwoPlaces ? "duplicated" : "silent");
      fault.set_run(run.name);
      *fault.mutable_robot() = json_value(found.robot);
      fault.set_in_words(fmt::format("{}, robot {}: {}", run.name, found.robot, found.reason));
    }
  }
}

/// Texts of the report in place of trajectory errors.
void add_words(identification::Identification& found) {
  const identification::Classifier& classifier = found.result().classifier();
  const auto add_bar = [&](const char* kind, const char* name, const identification::Area& area) {
    identification::Bar& bar = *found.add_bars();
    bar.set_kind(kind);
    bar.set_name(name);
    bar.set_value(area.area());
    bar.set_low(area.low());
    bar.set_high(area.high());
    bar.set_from(0.5);
  };
  const identification::Area &before = classifier.before(), &after = classifier.after(),
                             &days = classifier.measured_days();
  add_bar("before", "base model", before);
  add_bar("after", "with effects", after);
  add_bar("floor", "measured days", days);
  found.set_verdict(fmt::format(
      "Classifier two-sample test: measured (held-out days) against simulated windows of 200 s. The area under the "
      "ROC curve is 0.5 at chance level. It is {:.3f} for the base model and, for the model with effects, {:.3f} "
      "({:.3f} to {:.3f}). Measured days against each other: {:.3f}.",
      before.area(), after.area(), after.low(), after.high(), days.area()));
  found.add_summary(
      fmt::format("area under the ROC curve, simulated against measured held-out runs: {:.3f} before, {:.3f} after "
                  "({:.3f} to {:.3f}); measured days against each other {:.3f}",
                  before.area(), after.area(), after.low(), after.high(), days.area()));
  const identification::Result& result = found.result();
  for (const std::string& name : result.check().dropped())
    found.add_summary(
        fmt::format("{}: not written, because days that took no part are predicted no better with it", name));
  for (const std::string& words : {result.held_out().in_words(), result.check().in_words()}) {
    if (words.empty()) continue;
    found.add_summary(words);
    found.set_verdict(found.verdict() + " " + words);
  }
  identification::Table& table = *found.add_tables();
  table.set_id("features");
  table.set_title("Differences between simulated and measured robots");
  table.set_lead(
      "Area under the ROC curve of each single feature on held-out runs: 0.5 is chance level. Above it, the "
      "feature "
      "is larger in simulated runs, below it smaller.");
  for (const char* head : {"feature of 200 s", "base model", "with effects"}) table.add_head(head);
  for (const identification::ClassifierFeature& feature : classifier.features())
    *table.add_rows() = json_list(std::array{feature.name(), fmt::format("{:.3f}", feature.before()),
                                             fmt::format("{:.3f}", feature.after())});
}

/// A model on the held-out runs.
struct JudgedModel {
  Validation cells;
  FloorStatistics statistics;
  double misfit;
};

/// A model on the path of the search.
struct FloorStage {
  std::vector<std::string> effects;
  FloorModel model;
};

class FloorStudy final : public Study {
 public:
  FloorStudy(FloorDays days, Options options, std::filesystem::path ledger)
      : options_(std::move(options)),
        record_(std::move(ledger)),
        days_(without_unlike_runs(std::move(days))),
        learned_(days_.fit, floor_, options_.threads),
        choosing_(days_.choose, floor_, options_.threads),
        held_out_(days_.report, floor_, options_.threads) {}

  void fit() override;
  void search() override;
  void judge() override;
  Identified report() override;

 private:
  [[nodiscard]] identification::Result& out() { return *found_.mutable_result(); }
  void say(const std::string& what) const {
    if (options_.progress) options_.progress({stage_, what, stats::Work::kSame});
  }
  void begin(FloorWork kind, const char* stage) {
    stage_ = stage;
    if (options_.progress)
      options_.progress(floor_work(kind, stage_, static_cast<int>(effects_of(model_)), options_.find_effects));
  }
  [[nodiscard]] FloorProgress progress() const {
    return [this](const std::string& what) { say(what); };
  }
  FloorDays without_unlike_runs(FloorDays);
  /// Chooses among the models of the search by the days that choose, and refits the chosen one to these days too.
  void choose();
  /// Errors of both models, and of the model without each effect. From here on the reported days are open.
  void predict();
  void compare_with_days();
  void drop(const std::vector<std::string>& kept);
  void refit();
  void add_caveats(const OpenedDays::Opened&);
  void note(const std::string& added, const FloorModel& model);
  [[nodiscard]] JudgedModel judged(const FloorModel& model, std::uint64_t seed, std::vector<Predicted>& to) const;
  [[nodiscard]] identification::Effect judged_effect(std::size_t e);
  void add_parameters(std::size_t e, JsonFields& parameters) const;
  void add_ambiguities();
  void add_statistics();
  void add_base();
  [[nodiscard]] identification::Estimate number(std::size_t parameter) const;

  const Options options_;
  const OpenedDays record_;
  const Floor floor_;
  identification::Identification found_;
  std::string stage_;
  std::vector<FloorRun> unlike_;
  const FloorDays days_;
  const FloorTarget learned_, choosing_, held_out_;
  std::vector<FloorStage> path_;  ///< of the search, base model first
  FloorModel base_, model_;
  std::vector<double> errors_;  ///< standard errors of the values of model_
  std::vector<EffectGain> gains_;
  std::vector<Predicted> by_base_, by_model_;
  JudgedModel before_ = {}, after_ = {};
};

/// An unlike day is reported, and neither fits nor chooses: its conditions need not recur.
FloorDays FloorStudy::without_unlike_runs(FloorDays days) {
  for (const auto* runs : {&days.fit, &days.report}) add_faults(out(), *runs);
  if (!days.chose_on_reported) add_faults(out(), days.choose);
  const std::size_t fitted = days.fit.size();
  std::vector<FloorRun> all = std::move(days.fit);
  if (!days.chose_on_reported) std::move(days.choose.begin(), days.choose.end(), std::back_inserter(all));
  const std::vector<UnlikeRun> unlikes = unlike_runs(all, floor_);
  std::vector<FloorRun> choose;
  days.fit.clear();
  for (std::size_t r = 0; r < all.size(); ++r) {
    const auto is = std::find_if(unlikes.begin(), unlikes.end(), [&](const UnlikeRun& u) { return u.run == r; });
    if (is == unlikes.end()) {
      (r < fitted ? days.fit : choose).push_back(std::move(all[r]));
      continue;
    }
    identification::Fault& fault = *out().add_faults();
    fault.set_kind("unlike");
    fault.set_run(all[r].name);
    fault.set_in_words(
        fmt::format("{}: the robots behaved differently from those of the other runs ({}: {:.3g} "
                    "against {:.3g}); the run is excluded from the fit",
                    all[r].name, is->worst, is->value, is->others));
    say(fmt::format("{} is unlike the other runs", all[r].name));
    unlike_.push_back(std::move(all[r]));
  }
  if (days.chose_on_reported) return days;
  days.choose = std::move(choose);
  // The only day that could choose is unlike the others.
  days.chose_on_reported = days.choose.empty();
  if (days.chose_on_reported) days.choose = days.report;
  return days;
}

/// On the days that choose: the reported days stay closed during the search.
void FloorStudy::note(const std::string& added, const FloorModel& model) {
  const double misfit = choosing_.misfit(simulated_statistics(choosing_, model.settings(), 4711));
  identification::Step& step = *found_.add_steps();
  step.set_added(added);
  step.set_held_out_misfit(misfit);
  path_.push_back({names_of(model), model});
  say(fmt::format("{}: misfit on the days that choose {:.0f}, {} statistics", added, misfit, choosing_.size()));
}

void FloorStudy::fit() {
  begin(kBase, "base model");
  base_.add(base_term());
  fit_from_far_start(base_, learned_, 1, progress());
  kilogrid::fit(base_, learned_, 2, 1, 1, progress());
  model_ = base_;
  note("base", base_);
}

void FloorStudy::search() {
  FloorFound found = search_effects(
      base_, learned_, candidate_terms(floor_), options_.progress ? options_.progress : [](const stats::Work&) {},
      [&](const std::string& added, const FloorModel& model) { note(added, model); });
  model_ = std::move(found.model);
  gains_ = std::move(found.gains);
  for (const RejectedEffect& effect : found.rejected) {
    identification::Rejected& rejected = *out().add_rejected();
    rejected.set_name(effect.gain.name);
    assign(rejected.mutable_covariates(), effect.covariates);
    rejected.set_acts_on(effect.acts_on);
    rejected.set_misfit_gain(effect.gain.gain);
    rejected.set_misfit_gain_needed(effect.gain.needed);
    rejected.set_why(effect.why);
  }
}

void FloorStudy::choose() {
  begin(kChoice, "last check");
  // Without elimination and without walls it is the last model already.
  if (model_.values != path_.back().model.values || names_of(model_) != path_.back().effects)
    path_.push_back({names_of(model_), model_});
  std::vector<FloorScore> scores;
  Validation of_base;
  for (const FloorStage& stage : path_) {
    const FloorSettings settings = stage.model.settings();
    const Validation cells =
        validate(days_.choose, floor_, settings, options_.horizon_s, options_.threads, nullptr);
    if (scores.empty()) of_base = cells;
    scores.push_back({choosing_.misfit(simulated_statistics(choosing_, settings, 4712, 2)), cells.rmse_mm(),
                      excess_of(cells, of_base)});
    identification::CheckedModel& checked = *out().mutable_check()->add_path();
    assign(checked.mutable_effects(), stage.effects);
    checked.set_rmse_mm(scores.back().rmse_mm);
    checked.set_misfit(scores.back().misfit);
  }
  const std::size_t kept = chosen_model(scores);
  out().mutable_check()->set_kept(static_cast<std::uint32_t>(kept));
  const FloorStage stage = path_[kept];
  drop(stage.effects);
  model_ = stage.model;
  say(fmt::format("the days that choose keep {} of {} effects", stage.effects.size(), path_.back().effects.size()));
  if (!days_.chose_on_reported) refit();
}

/// Effects of the search that are not written leave the findings, except that they were dropped.
void FloorStudy::drop(const std::vector<std::string>& kept) {
  for (std::size_t e = 0; e < effects_of(model_); ++e) {
    const std::string name = name_of(model_, e);
    if (std::find(kept.begin(), kept.end(), name) != kept.end()) continue;
    out().mutable_check()->add_dropped(name);
    identification::Rejected& rejected = *out().add_rejected();
    rejected.set_name(name);
    assign(rejected.mutable_covariates(), covariates_of(model_, e));
    rejected.set_acts_on(name == kWallEffect ? "WHEEL_GAIN" : model_.terms[e + 1].acts_on);
    rejected.set_why("days that took no part in the search are predicted no better with it");
  }
  // An effect that the search took out again may be back.
  std::vector<EffectGain> gains;
  for (const std::string& name : kept) {
    const auto known =
        std::find_if(gains_.begin(), gains_.end(), [&](const EffectGain& gain) { return gain.name == name; });
    gains.push_back(known == gains_.end() ? EffectGain{name, 0, 0} : *known);
  }
  gains_ = std::move(gains);
}

/// The days that choose are days of the fit once they have chosen.
void FloorStudy::refit() {
  std::vector<FloorRun> all = days_.fit;
  all.insert(all.end(), days_.choose.begin(), days_.choose.end());
  const FloorTarget target(all, floor_, options_.threads);
  kilogrid::fit(base_, target, 1, 0.5, 400, progress());
  if (effects_of(model_) > 0)
    kilogrid::fit(model_, target, 1, 0.5, 400, progress());
  else
    model_ = base_;
  errors_ = standard_errors(model_, target, kErrorsSeed);
}

JudgedModel FloorStudy::judged(const FloorModel& model, std::uint64_t seed, std::vector<Predicted>& to) const {
  JudgedModel out{validate(days_.report, floor_, model.settings(), options_.horizon_s, options_.threads, &to),
                  simulated_statistics(held_out_, model.settings(), seed, 2), 0};
  out.misfit = held_out_.misfit(out.statistics);
  return out;
}

void FloorStudy::add_parameters(std::size_t e, JsonFields& parameters) const {
  if (name_of(model_, e) == kWallEffect) {
    parameters["form"] = json_value("steps");
    parameters["beside_mm"] = json_value(FloorModel::kBeside_mm);
    parameters["part_of_speed"] = json_value(json_list(*model_.wall));
    return;
  }
  const std::vector<FloorParameter>& all = model_.terms[e + 1].parameters;
  parameters["form"] = json_value("record of the model");
  for (std::size_t p = 0; p < all.size(); ++p)
    parameters[all[p].name] = json_value(model_.values[model_.first_of(e + 1) + p]);
}

/// A parameter with its 95 % interval. An interval as wide as the range that the parameter may have says nothing.
identification::Estimate FloorStudy::number(std::size_t parameter) const {
  const FloorParameter of = model_.parameters()[parameter];
  const double value = model_.values[parameter], half = stats::kNormal95 * errors_[parameter];
  identification::Estimate out;
  out.set_name(of.name);
  out.set_value(value);
  if (2 * half < of.most - of.least) {
    out.set_low(std::max(of.least, value - half));
    out.set_high(std::min(of.most, value + half));
    out.set_how("linearised method of moments");
  } else {
    out.set_how("no interval: these data leave it open");
  }
  return out;
}

identification::Effect FloorStudy::judged_effect(std::size_t e) {
  const FloorModel less = without(model_, e);
  const std::string name = name_of(model_, e);
  const bool is_wall = name == kWallEffect;
  const double misfit = held_out_.misfit(simulated_statistics(held_out_, less.settings(), 79));
  const Validation lesser =
      validate(days_.report, floor_, less.settings(), options_.horizon_s, options_.threads, nullptr);
  const double gain_nat = after_.cells.log_likelihood - lesser.log_likelihood;
  identification::Effect effect;
  effect.set_name(name);
  assign(effect.mutable_covariates(), covariates_of(model_, e));
  effect.set_acts_on(is_wall ? "WHEEL_GAIN" : model_.terms[e + 1].acts_on);
  identification::Evidence& evidence = *effect.mutable_evidence();
  evidence.set_misfit_gain(gains_[e].gain);
  evidence.set_misfit_gain_needed(gains_[e].needed);
  evidence.set_held_out_misfit_without(misfit);
  evidence.set_held_out_misfit(after_.misfit);
  evidence.set_log_likelihood_gain(gain_nat);
  add_parameters(e, *effect.mutable_parameters()->mutable_fields());
  *effect.mutable_rmse_without_mm() = json_value(lesser.rmse_mm());
  *effect.mutable_share_removed() =
      json_value((misfit - after_.misfit) / std::max(before_.misfit - after_.misfit, 1e-9));
  auto& facts = *effect.mutable_facts()->mutable_fields();
  facts["misfit of training runs"] =
      json_value(fmt::format("lowered by {:.0f}; significance bound {:.0f}", gains_[e].gain, gains_[e].needed));
  facts["misfit on held-out runs"] =
      json_value(fmt::format("{:.0f} without it, {:.0f} with it", misfit, after_.misfit));
  facts["cells 10 s ahead"] =
      json_value(fmt::format("{:.1f} mm without it, {:.1f} mm with it", lesser.rmse_mm(), after_.cells.rmse_mm()));
  facts["likelihood of cells"] = json_value(fmt::format("{:+.0f} nat with it, for single-robot filters", gain_nat));
  effect.set_in_words(is_wall ? words_of_wall(model_) : words_of(model_, e + 1));
  for (std::size_t p = 0; !is_wall && p < model_.terms[e + 1].parameters.size(); ++p)
    *effect.add_numbers() = number(model_.first_of(e + 1) + p);
  say(fmt::format("{}: misfit {:.0f} without it, {:.0f} with it", name, misfit, after_.misfit));
  return effect;
}

void FloorStudy::add_ambiguities() {
  const auto add = [&](const std::string& found, const char* instead, const std::string& experiment) {
    identification::Ambiguous& ambiguous = *out().add_ambiguous();
    ambiguous.set_found(found);
    ambiguous.set_instead(instead);
    ambiguous.set_experiment(experiment);
  };
  for (std::size_t t = 1; t < model_.terms.size(); ++t) {
    if (!model_.terms[t].experiment.empty())
      add(model_.terms[t].name, "see experiment", model_.terms[t].experiment);
  }
  if (model_.wall)
    add(kWallEffect, "boundary messages that make robots turn away for longer in some places",
        "let robots drive along the wall with the boundary messages switched off");
}

/// Adds the caveats of the errors, for readers.
void FloorStudy::add_caveats(const OpenedDays::Opened& opened) {
  std::vector<std::string> sentences;
  if (days_.chose_on_reported)
    sentences.emplace_back(
        "The same days chose the model and give its errors, so that the errors are too small; more days would "
        "allow "
        "others to choose.");
  if (opened.before > 0)
    sentences.push_back(fmt::format(
        "The reported days are not unseen: {} other search{} reported on them before ({} beside the data). Only "
        "new days can confirm this model.",
        opened.before, opened.before == 1 ? " was" : "es were", OpenedDays::kFile));
  if (!opened.unwritable.empty())
    sentences.push_back(
        fmt::format("The report on these days could not be recorded: {}. Make it possible to write there, then "
                    "repeat the command.",
                    opened.unwritable));
  if (effects_of(model_) > 0 && !(after_.misfit <= before_.misfit))
    sentences.push_back(
        fmt::format("On the reported days the misfit is larger with effects than without ({:.0f}, {:.0f}): they "
                    "differ from the "
                    "days of the fit.",
                    after_.misfit, before_.misfit));
  if (!sentences.empty()) out().mutable_check()->set_in_words(fmt::format("{}", fmt::join(sentences, " ")));
  identification::HeldOut& held_out = *out().mutable_held_out();
  held_out.set_kind("days");
  held_out.set_opened_before(static_cast<std::uint32_t>(opened.before));
  std::vector<std::string> reported, choosing;
  for (const FloorRun& run : days_.report) reported.push_back(run.name);
  for (const FloorRun& run : days_.choose) choosing.push_back(run.name);
  held_out.set_in_words(fmt::format("Days that give the errors: {}. Days that chose the model: {}.",
                                    fmt::join(reported, ", "), fmt::join(choosing, ", ")));
}

/// The date in UTC: for people who read the record of opened days.
std::string today() {
  return fmt::format("{:%Y-%m-%d}", std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()));
}

void FloorStudy::predict() {
  begin(kPredictions, "predictions");
  const OpenedDays::Opened opened =
      record_.open(days_.report, days_.searched(),
                   fmt::format("horizon {} s, effects {}", options_.horizon_s, options_.find_effects), today());
  if (errors_.empty()) errors_ = standard_errors(model_, learned_, kErrorsSeed);
  before_ = judged(base_, 78, by_base_);
  after_ = judged(model_, 79, by_model_);
  for (const auto& [to, of] : {std::pair{out().mutable_before(), &before_}, {out().mutable_after(), &after_}}) {
    *to = accuracy_of(of->cells);
    to->set_misfit(of->misfit);
  }
  std::vector<identification::Effect> effects;
  for (std::size_t e = 0; e < effects_of(model_); ++e) effects.push_back(judged_effect(e));
  std::stable_sort(effects.begin(), effects.end(),
                   [](const identification::Effect& a, const identification::Effect& b) {
                     return a.share_removed().number_value() > b.share_removed().number_value();
                   });
  for (identification::Effect& effect : effects) *out().add_effects() = std::move(effect);
  add_ambiguities();
  add_caveats(opened);
}

void FloorStudy::add_statistics() {
  std::vector<double> sd(statistic_count());
  for (std::size_t s = 0; s < sd.size(); ++s) sd[s] = std::sqrt(held_out_.tolerance()[s]);
  for (const StatisticGroup& group : statistic_groups()) {
    const bool root = group.name == "msd";
    identification::FloorStatistic& statistic = *out().add_statistics();
    statistic.set_name(group.name);
    statistic.set_covariate(group.covariate);
    assign(statistic.mutable_labels(), group.labels);
    *statistic.mutable_measured() = numbers(held_out_.statistics().value, group, root);
    *statistic.mutable_tolerance() = root ? json_null() : json_value(numbers(sd, group, false));
    *statistic.mutable_before() = numbers(before_.statistics.value, group, root);
    *statistic.mutable_after() = numbers(after_.statistics.value, group, root);
    statistic.set_misfit_before(held_out_.misfit(before_.statistics, group));
    statistic.set_misfit_after(held_out_.misfit(after_.statistics, group));
  }
}

void FloorStudy::compare_with_days() {
  begin(kClassifier, "classifier");
  add_statistics();
  std::vector<FloorRun> alike = days_.fit;
  if (!days_.chose_on_reported) alike.insert(alike.end(), days_.choose.begin(), days_.choose.end());
  *out().mutable_classifier() =
      classify(alike, unlike_, days_.report, held_out_, base_.settings(), model_.settings());
  *found_.add_tables() = table_of_motion(held_out_, before_.statistics, after_.statistics);
  add_words(found_);
  add_plots(found_, held_out_, before_.statistics, after_.statistics);
}

/// The first four parameters of the base term belong to the drive, the others to the reception of cells.
void FloorStudy::add_base() {
  identification::Base& base = *out().mutable_base();
  base.set_straight_speed_mm_s(model_.values[0]);
  base.set_turn_speed_mm_s(model_.values[1]);
  base.set_bias_sd_mm_s(model_.values[2]);
  base.set_factor_variance_s(model_.values[3]);
  auto& floor = *out().mutable_floor()->mutable_fields();
  const auto parameters = base_term().parameters;
  for (std::size_t p = 4; p < parameters.size(); ++p) floor[parameters[p].name] = json_value(model_.values[p]);
  for (std::size_t p = 0; p < parameters.size(); ++p) *out().add_floor_numbers() = number(p);
  floor["cell_later"] = json_value(json_list(model_.settings().radio.later));
}

Identified FloorStudy::report() {
  const FloorSettings settings = model_.settings();
  out().set_noise_floor_mm(cell_noise_mm(floor_, settings.radio));
  out().set_noise_floor_how(
      "root mean square distance between robots and the centres of the cells that report them: the error of "
      "exactly known positions");
  out().set_horizon_s(options_.horizon_s);
  add_base();
  found_.mutable_set()->set_has_headings(false);
  found_.mutable_set()->set_has_commands(false);
  const std::size_t choosing = days_.chose_on_reported ? 0 : days_.choose.size();
  found_.mutable_set()->set_train(static_cast<std::uint32_t>(days_.fit.size() + choosing + unlike_.size()));
  found_.mutable_set()->set_test(static_cast<std::uint32_t>(days_.report.size()));
  Identified identified;
  identified.model = settings.model;
  for (std::size_t i = 0; i < std::min(by_base_.size(), by_model_.size()); ++i) {
    const Predicted &b = by_base_[i], &a = by_model_[i];
    identified.predictions.push_back({b.run, b.robot, b.at.time_s, b.at.x_mm, b.at.y_mm, a.at.x_mm, a.at.y_mm});
  }
  identified.found = std::move(found_);
  return identified;
}

void FloorStudy::judge() {
  choose();
  predict();
  compare_with_days();
}

}  // namespace

std::unique_ptr<Study> floor_study(std::vector<FloorRun> train, std::vector<FloorRun> test, const Options& options,
                                   std::filesystem::path ledger) {
  return std::make_unique<FloorStudy>(divided(std::move(train), std::move(test)), options, std::move(ledger));
}

}  // namespace kilotwin::kilogrid

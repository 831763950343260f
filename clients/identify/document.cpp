#include "clients/identify/document.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "clients/identify/bands.hpp"
#include "clients/identify/estimates.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/effect_text.hpp"
#include "clients/identify/predict/final_check.hpp"
#include "clients/identify/residual_plots.hpp"
#include "clients/identify/result/covariate_words.hpp"
#include "clients/identify/result/values.hpp"

namespace kilotwin::identify {
namespace {

/// Root mean square error, with its 95 % interval if known; null if nothing is held out.
identification::Accuracy accuracy_of(const PredictionErrors& errors, const std::optional<ErrorBounds>& bounds,
                                     Interval ErrorBounds::*which) {
  identification::Accuracy out;
  *out.mutable_rmse_mm() = errors.rows > 0 ? json_value(errors.rmse_mm()) : json_null();
  out.set_rows(static_cast<std::uint32_t>(errors.rows));
  if (bounds) {
    out.set_rmse_low_mm(((*bounds).*which).low_mm);
    out.set_rmse_high_mm(((*bounds).*which).high_mm);
  }
  return out;
}

/// Reduction of the error.
identification::Improvement improvement_of(const PredictionErrors& before, const PredictionErrors& after,
                                           const std::optional<ErrorBounds>& bounds) {
  identification::Improvement out;
  if (before.rows == 0) return out;
  out.set_less_by_mm(before.rmse_mm() - after.rmse_mm());
  if (bounds) {
    out.set_low_mm(bounds->less_by.low_mm);
    out.set_high_mm(bounds->less_by.high_mm);
    out.set_bounds_how(
        fmt::format("95 %, by a bootstrap over {}{}", bounds->runs > 1 ? "robots and runs" : "robots",
                    bounds->runs > 1 ? fmt::format(", {} robots and {} runs", bounds->robots, bounds->runs)
                                     : fmt::format(": {} robots in one run", bounds->robots)));
  }
  return out;
}

/// An experiment that separates two effects: it varies the covariate of one and holds that of the other.
std::string experiment_for(const std::vector<std::string>& found, const std::vector<std::string>& instead) {
  const auto only_one = [&](const char* word) {
    return (std::find(found.begin(), found.end(), word) != found.end()) !=
           (std::find(instead.begin(), instead.end(), word) != instead.end());
  };
  if (only_one("motor_time"))
    return "let some robots rest for the first half of a run: motor-on time and run time then differ";
  if (only_one("time_since_command")) return "command motions of very different durations in random order";
  if (only_one("measurement"))
    return "rotate or shift the camera between two runs: effects of the camera move with it";
  if (only_one("robot")) return "exchange the start positions of fast and slow robots between runs";
  if (only_one("neighbours")) return "repeat a run with each robot alone";
  if (only_one("position"))
    return "start the same robots from other positions, and rotate the placement by 90 degrees";
  if (only_one("world_frame") || only_one("heading"))
    return "repeat the commands with all robots rotated by 90 degrees";
  if (only_one("time")) return "start the same commands later after power-on";
  if (only_one("history") || only_one("command"))
    return "command left and right turns in random order before straight segments of equal length";
  return "repeat the runs with more robots, or for longer";
}

/// Whether the written model predicts the held-out data worse than the base model, beyond chance.
bool predicts_worse(const Findings& f) {
  return (!f.found.fit.model.terms.empty() || f.stalls) && f.bounds && f.bounds->less_by.high_mm < 0;
}

/// The most useful thing to do next, as one sentence.
std::string next_step(const Findings& f) {
  if (f.held_out == HeldOut::kNothing)
    return "Measure a second run, or at least four robots, so that held-out data can confirm the effects.";
  if (f.held_out == HeldOut::kNoTime) return "Measure longer runs, so that predictions can be compared with them.";
  if (f.numbering.anew())
    return "Give each robot the same number in all runs, or other numbers in each run, and identify again.";
  if (predicts_worse(f))
    return "Find out whether the held-out data differ from the data of the fit, or whether an effect is false.";
  if (f.unexplained.large())
    return f.replicates
               ? "Look for the cause of what is left unexplained, in the covariates that it varies with."
               : "Repeat the commands of one run, so that repetitions show how much can be explained at all.";
  if (f.unexplained.perhaps)
    return "Record more runs: the error exceeds what is expected, and too few data are held out to be sure that "
           "it is not chance.";
  if (!f.check.dropped.empty())
    return "Record more runs: they show whether an effect that was not written held in the data of the fit only, "
           "stood for another one, or was chance.";
  if (!f.found.ambiguous.empty()) {
    const Ambiguity& a = f.found.ambiguous.front();
    return fmt::format("To tell {} from {}: {}.", a.found, a.instead,
                       experiment_for(a.found_covariates, a.covariates));
  }
  return fmt::format("Use the model: kilotwin run EXPERIMENT --model {}", f.model_file);
}

/// Share of the reduction of the mean square error that is lost without a term.
double share_removed(const Findings& f, double without_mm) {
  const double before_mm = f.before.errors.rmse_mm(), after_mm = f.after.errors.rmse_mm(),
               gap = before_mm * before_mm - after_mm * after_mm;
  if (gap <= 0) return 0;
  return std::clamp((without_mm * without_mm - after_mm * after_mm) / gap, 0.0, 1.0);
}

identification::Evidence evidence_of(const Findings& f, std::size_t t) {
  const Reason& reason = f.found.reasons[t];
  identification::Evidence out;
  out.set_log10_p(reason.finding.log10_p);
  out.set_threshold_log10_p(reason.threshold_log10_p);
  out.set_p_family(
      std::min(1.0, ScoreTest::kFamilyAlarm *
                        std::pow(10.0, std::max(-300.0, reason.finding.log10_p - reason.threshold_log10_p))));
  out.set_log_likelihood_gain(reason.finding.evidence);
  const bool chosen = !f.check.gains.empty();
  *out.mutable_held_out_gain() = chosen ? json_value(f.check.gains[t].nat) : json_null();
  *out.mutable_held_out_gain_se() = chosen ? json_value(f.check.gains[t].nat_se) : json_null();
  out.set_degrees(static_cast<std::uint32_t>(reason.finding.degrees));
  return out;
}

identification::Effect effect_of(const Findings& f, std::size_t t) {
  const Term& term = f.found.fit.model.terms[t];
  const Reason& reason = f.found.reasons[t];
  const std::vector<proto::Effect> written = effects_of_term(term);
  std::vector<std::string> records, covariates;
  for (const proto::Effect& effect : written) records.push_back(effect.ShortDebugString());
  for (const std::string& covariate : reason.covariates) covariates.push_back(covariate_in_words(covariate));
  identification::Effect out;
  out.set_name(term.name);
  assign(out.mutable_covariates(), reason.covariates);
  out.set_acts_on(reason.acts_on);
  *out.mutable_evidence() = evidence_of(f, t);
  auto& parameters = *out.mutable_parameters()->mutable_fields();
  parameters["form"] = json_value(form_of(term));
  parameters["columns"] = json_value(term.coefficients.size());
  parameters["records"] = json_value(json_list(records));
  parameters["bands_95"] = json_value(bands_of(f.found.fit.model, t, f.uncertainty, f.steps));
  for (identification::Estimate& number : estimates_of(t, f.uncertainty, f.steps))
    *out.add_numbers() = std::move(number);
  const bool judged = !f.rmse_without_mm.empty();
  *out.mutable_rmse_without_mm() = judged ? json_value(f.rmse_without_mm[t]) : json_null();
  *out.mutable_share_removed() = judged ? json_value(share_removed(f, f.rmse_without_mm[t])) : json_null();
  const std::string size = size_in_words(written);
  out.set_in_words(fmt::format("{} depends on {}{}{}", reason.acts_on, fmt::join(covariates, ", "),
                               size.empty() ? "" : ": ", size));
  return out;
}

using Effects = google::protobuf::RepeatedPtrField<identification::Effect>;

/// Takes the shares of the effects out if they do not add up, as with effects that overlap.
void keep_shares_that_add_up(Effects& effects) {
  double sum = 0;
  for (const identification::Effect& effect : effects) sum += effect.share_removed().number_value();
  // Largest difference of the sum from 1; a larger value keeps shares that count effects twice.
  constexpr double kOff = 0.1;
  if (effects.size() < 2 || std::abs(sum - 1) < kOff) return;
  for (identification::Effect& effect : effects) *effect.mutable_share_removed() = json_null();
}

/// Adds the bands of another term of the same name. Its blocks count from the last one on.
void add_bands(identification::Effect& to, const identification::Effect& from) {
  constexpr const char* kBands = "bands_95";
  auto& known = *(*to.mutable_parameters()->mutable_fields())[kBands].mutable_list_value();
  const int before = known.values_size();
  for (JsonValue band : from.parameters().fields().at(kBands).list_value().values()) {
    auto& block = (*band.mutable_struct_value()->mutable_fields())["block"];
    block = json_value(block.number_value() + before);
    *known.add_values() = std::move(band);
  }
}

/// One entry per effect. Terms of one name share an entry, with the largest loss among them.
Effects effects_of(const Findings& f) {
  Effects effects;
  for (std::size_t t = 0; t < f.found.fit.model.terms.size(); ++t) {
    identification::Effect effect = effect_of(f, t);
    const auto known = std::find_if(effects.begin(), effects.end(),
                                    [&](const identification::Effect& e) { return e.name() == effect.name(); });
    if (known == effects.end()) {
      *effects.Add() = std::move(effect);
      continue;
    }
    known->mutable_numbers()->MergeFrom(effect.numbers());
    add_bands(*known, effect);
    if (f.rmse_without_mm.empty()) continue;
    if (known->rmse_without_mm().number_value() < effect.rmse_without_mm().number_value())
      *known->mutable_rmse_without_mm() = effect.rmse_without_mm();
    const identification::Evidence& other = effect.evidence();
    if (known->evidence().held_out_gain().number_value() < other.held_out_gain().number_value()) {
      *known->mutable_evidence()->mutable_held_out_gain() = other.held_out_gain();
      *known->mutable_evidence()->mutable_held_out_gain_se() = other.held_out_gain_se();
    }
  }
  keep_shares_that_add_up(effects);
  std::stable_sort(effects.begin(), effects.end(),
                   [](const identification::Effect& a, const identification::Effect& b) {
                     return a.evidence().log_likelihood_gain() > b.evidence().log_likelihood_gain();
                   });
  return effects;
}

identification::DataSet describe_set(const MeasuredSet& train, const MeasuredSet* test, HeldOut held_out) {
  double duration_s = 0;
  std::vector<double> steps;
  for (const Run& run : train.runs) {
    for (const Track& track : run.tracks) {
      if (!track.samples.empty()) duration_s = std::max(duration_s, track.samples.back().time_s);
      for (std::size_t i = 1; i < track.samples.size(); i += 10)
        steps.push_back(track.samples[i].time_s - track.samples[i - 1].time_s);
    }
  }
  std::sort(steps.begin(), steps.end());
  const auto count = [](std::size_t n) { return static_cast<std::uint32_t>(n); };
  identification::DataSet out;
  out.set_runs(count(train.runs.size()));
  out.set_robots(count(train.robots().size()));
  out.set_tracks(count(train.tracks()));
  out.set_samples(count(train.samples()));
  out.set_test_samples(test != nullptr ? count(test->samples()) : 0);
  out.set_has_headings(train.has_headings);
  out.set_has_commands(train.has_commands);
  out.set_duration_s(duration_s);
  out.set_sample_interval_s(steps.empty() ? 0 : steps[steps.size() / 2]);
  out.set_held_out(name_of(held_out));
  return out;
}

identification::Rejected rejected_of(const Rejected& r) {
  identification::Rejected out;
  out.set_name(r.name);
  assign(out.mutable_covariates(), r.covariates);
  out.set_acts_on(r.acts_on);
  out.set_log10_p(r.log10_p);
  out.set_threshold_log10_p(r.threshold_log10_p);
  if (!r.why.empty()) out.set_why(r.why);
  return out;
}

identification::Ambiguous ambiguous_of(const Ambiguity& a) {
  identification::Ambiguous out;
  out.set_found(a.found);
  out.set_instead(a.instead);
  out.set_experiment(experiment_for(a.found_covariates, a.covariates));
  out.set_log_likelihood_difference(a.evidence_difference);
  return out;
}

identification::Base base_of(const BaseParameters& base) {
  identification::Base out;
  out.set_straight_speed_mm_s(base.straight_mm_s);
  out.set_turn_speed_mm_s(base.turn_mm_s);
  out.set_wheel_base_mm(base.wheel_base_mm);
  out.set_tracked_point_ahead_mm(base.ahead_mm);
  out.set_tracked_point_left_mm(base.left_mm);
  out.set_disc_centre_ahead_mm(base.centre_mm);
  out.set_bias_mean_mm_s(base.bias_mean_mm_s);
  out.set_bias_sd_mm_s(base.bias_sd_mm_s);
  out.set_command_lag_s(base.command_lag_s);
  return out;
}

/// Standard deviations of the base parameters.
identification::Base base_sd_of(const Uncertainty& u) {
  identification::Base out;
  out.set_straight_speed_mm_s(u.sd(kStraightSpeed));
  out.set_turn_speed_mm_s(u.sd(kTurnSpeed));
  out.set_wheel_base_mm(u.sd(kWheelBase));
  out.set_tracked_point_ahead_mm(u.sd(kAheadPoint));
  out.set_tracked_point_left_mm(u.sd(kLeftPoint));
  out.set_bias_mean_mm_s(u.bias_mean_sd_mm_s);
  out.set_bias_sd_mm_s(u.bias_sd_sd_mm_s);
  return out;
}

identification::Numbering entry_of(const Numbering& numbering) {
  identification::Numbering out;
  out.set_anew_in_each_run(numbering.anew());
  out.set_spread(numbering.spread);
  out.set_chance(numbering.chance);
  if (numbering.anew())
    out.set_in_words(
        "Robots seem to be numbered anew in each run: they differ in speed, but a number does not have the same "
        "speed in all runs.");
  return out;
}

/// Where contacts and walls act, and what the data say about it.
identification::DiscCentre disc_centre_of(const MotionModel& model, const GeometryIntervals& intervals) {
  // Distance below which the disc centre counts as the tracked point, and nat from which on contacts count as its evidence.
  // They decide words, no fit.
  constexpr double kSame_mm = 3, kTold = 3;
  const bool tracked = std::abs(model.base.centre_mm - model.base.ahead_mm) < kSame_mm;
  const std::string where =
      tracked ? "at the tracked point"
              : fmt::format("{:.1f} mm ahead of the drive's reference point", model.base.centre_mm);
  const double evidence = model.centre_evidence;
  const bool bounded = intervals.centre_low_mm && intervals.centre_high_mm;
  const std::string why = evidence > kTold
                              ? fmt::format("determined by contacts, with {:.0f} nat of log likelihood", evidence)
                          : bounded       ? std::string("determined by contacts")
                          : evidence == 0 ? std::string("assumed: not identifiable from these data")
                                          : std::string("determined by how near robots come to each other");
  identification::DiscCentre out;
  out.set_ahead_mm(model.base.centre_mm);
  out.set_at_tracked_point(tracked);
  out.set_log_likelihood_over_alternative(evidence);
  const std::string interval = bounded ? fmt::format("; 95 % interval {:.1f} to {:.1f} mm",
                                                     *intervals.centre_low_mm, *intervals.centre_high_mm)
                                       : "";
  out.set_in_words(fmt::format("Contacts and walls act {} ({}{}).", where, why, interval));
  if (intervals.centre_low_mm) out.set_low_mm(*intervals.centre_low_mm);
  if (intervals.centre_high_mm) out.set_high_mm(*intervals.centre_high_mm);
  return out;
}

identification::Noise noise_of(const Noise& noise) {
  identification::Noise out;
  out.set_factor_variance_s(noise.factor_s);
  out.set_wheel_sd_mm(std::sqrt(noise.wheel_mm2_s));
  out.set_heading_sd_rad(std::sqrt(noise.heading_rad2_s));
  out.set_drift_sd_mm(std::sqrt(noise.drift_mm2_s));
  out.set_tracker_position_sd_mm(std::sqrt(noise.position_mm2));
  out.set_tracker_heading_sd_rad(std::sqrt(noise.heading_rad2));
  out.set_at_walls_sd_mm(std::sqrt(noise.wall_mm2_s));
  out.set_at_walls_sd_rad(std::sqrt(noise.wall_rad2_s));
  out.set_at_robots_sd_mm(std::sqrt(noise.contact_mm2_s));
  out.set_at_robots_sd_rad(std::sqrt(noise.contact_rad2_s));
  return out;
}

identification::Walls walls_of(const Walls& walls) {
  identification::Walls out;
  if (std::isfinite(walls.x_low_mm)) out.set_x_low_mm(walls.x_low_mm);
  if (std::isfinite(walls.x_high_mm)) out.set_x_high_mm(walls.x_high_mm);
  if (std::isfinite(walls.y_low_mm)) out.set_y_low_mm(walls.y_low_mm);
  if (std::isfinite(walls.y_high_mm)) out.set_y_high_mm(walls.y_high_mm);
  return out;
}

/// Caveats of the errors and the search, for readers; empty: none.
std::string caveats_of(const Findings& f) {
  std::vector<std::string> sentences;
  const double before_mm = f.before.errors.rmse_mm(), after_mm = f.after.errors.rmse_mm();
  const bool has_effects = !f.found.fit.model.terms.empty() || f.stalls;
  if (predicts_worse(f))
    sentences.push_back(fmt::format(
        "With effects the error on these data is larger than that of the base model ({:.2f} mm, {:.2f} mm), beyond "
        "chance. Either they differ from the data of the fit, or an effect is false.",
        after_mm, before_mm));
  if (has_effects && f.check.chose_on_reported)
    sentences.emplace_back(
        "The same held-out tracks chose the model and give its error, so that the error is too small.");
  if (has_effects && f.check.path.empty())
    sentences.emplace_back(
        "No track was left for the last check, so the effects are those of the search alone. More tracks would "
        "allow it.");
  if (!f.found.limit.empty()) sentences.push_back(f.found.limit);
  return fmt::format("{}", fmt::join(sentences, " "));
}

identification::Check check_of(const Findings& f) {
  identification::Check out;
  for (const CheckedModel& model : f.check.path) {
    identification::CheckedModel& checked = *out.add_path();
    assign(checked.mutable_effects(), model.effects);
    checked.set_rmse_mm(model.rmse_mm);
  }
  out.set_kept(static_cast<std::uint32_t>(f.check.kept));
  assign(out.mutable_dropped(), f.check.dropped);
  if (const std::string caveats = caveats_of(f); !caveats.empty()) out.set_in_words(caveats);
  return out;
}

/// One list per row; null where there are no data.
void assign_rows(google::protobuf::RepeatedPtrField<JsonList>* field, const Eigen::MatrixXd& values) {
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    std::vector<double> row;
    for (Eigen::Index j = 0; j < values.cols(); ++j) row.push_back(values(i, j));
    *field->Add() = json_list(row);
  }
}

identification::Pattern pattern_of(const Pattern& p) {
  identification::Pattern out;
  for (const Feature f : p.over) {
    out.add_covariates(name_of(f));
    out.add_units(unit_of(f));
  }
  out.add_components(p.in_body ? "ahead" : "x");
  out.add_components(p.in_body ? "left" : "y");
  out.set_share(p.share);
  assign(out.mutable_at(), p.at);
  assign(out.mutable_and_at(), p.and_at);
  assign_rows(out.mutable_first_mm(), p.first_mm);
  assign_rows(out.mutable_second_mm(), p.second_mm);
  return out;
}

identification::Unexplained unexplained_of(const Unexplained& u) {
  identification::Unexplained out;
  out.set_large(u.large());
  out.set_perhaps(u.perhaps);
  out.set_systematic_mm(u.systematic_mm);
  out.set_share(u.share);
  out.set_expected_mm(u.expected_mm);
  if (u.known_starts_mm) out.set_known_starts_mm(*u.known_starts_mm);
  if (u.known_starts_expected_mm) out.set_known_starts_expected_mm(*u.known_starts_expected_mm);
  *out.mutable_repetitions_mm() = json_value(u.repetitions_mm);
  for (const Pattern& p : u.patterns) *out.add_patterns() = pattern_of(p);
  out.set_in_words(u.in_words);
  if (u.learner) {
    identification::Learner& learner = *out.mutable_learner();
    learner.set_error_mm(u.learner->error_mm);
    learner.set_error_left_mm(u.learner->error_left_mm);
    learner.set_less_by_low_mm(u.learner->less_by_mm.low_mm);
    learner.set_less_by_high_mm(u.learner->less_by_mm.high_mm);
    learner.set_cross_validated(u.learner->cross_validated);
  }
  return out;
}

void add_robots(identification::Result& out, const Findings& f, const MeasuredSet& judged) {
  std::map<std::uint32_t, std::array<double, 3>> by_robot;
  for (const Judged* side : {&f.before, &f.after}) {
    for (const auto& [track, part] : side->errors.by_track) {
      auto& sums = by_robot[judged.runs[track.first].tracks[track.second].robot];
      sums[side == &f.before ? 0 : 1] += part.sum_mm2;
      if (side == &f.before) sums[2] += static_cast<double>(part.rows);
    }
  }
  for (const auto& [robot, bias] : f.found.fit.model.robots) {
    identification::Robot& entry = *out.add_robots();
    const auto known = f.uncertainty.biases.find(robot);
    const Eigen::Matrix2d covariance = known != f.uncertainty.biases.end() ? known->second : bias.covariance;
    entry.set_robot(robot);
    entry.set_bias_left_mm_s(bias.mean_mm_s[0]);
    entry.set_bias_right_mm_s(bias.mean_mm_s[1]);
    entry.set_sd_left_mm_s(std::sqrt(covariance(0, 0)));
    entry.set_sd_right_mm_s(std::sqrt(covariance(1, 1)));
    if (const auto ratio = f.noise_ratios.find(robot); ratio != f.noise_ratios.end()) {
      entry.set_noise_ratio(ratio->second.value);
      entry.set_noise_ratio_low(ratio->second.low);
      entry.set_noise_ratio_high(ratio->second.high);
    }
    if (const auto sums = by_robot.find(robot); sums != by_robot.end() && sums->second[2] > 0) {
      entry.set_before_mm(std::sqrt(sums->second[0] / sums->second[2]));
      entry.set_after_mm(std::sqrt(sums->second[1] / sums->second[2]));
    }
  }
}

/// Errors on held-out data, and what they are compared with.
void add_errors(identification::Result& out, const Findings& f, double horizon_s) {
  *out.mutable_before() = accuracy_of(f.before.errors, f.bounds, &ErrorBounds::before);
  *out.mutable_after() = accuracy_of(f.after.errors, f.bounds, &ErrorBounds::after);
  if (f.before.errors.rows > 0) {
    identification::FreeRobots& free = *out.mutable_free();
    *free.mutable_before_mm() = f.free_before.rows > 0 ? json_value(f.free_before.rmse_mm()) : json_null();
    *free.mutable_after_mm() = f.free_after.rows > 0 ? json_value(f.free_after.rmse_mm()) : json_null();
    free.set_rows(static_cast<std::uint32_t>(f.free_after.rows));
    free.set_share_of_rows(static_cast<double>(f.free_after.rows) / static_cast<double>(f.before.errors.rows));
  }
  *out.mutable_improvement() = improvement_of(f.before.errors, f.after.errors, f.bounds);
  out.mutable_held_out()->set_kind(name_of(f.held_out));
  out.mutable_held_out()->set_in_words(identify::in_words(f.held_out));
  out.set_noise_floor_mm(f.expected_mm);
  out.set_noise_floor_how(
      "the error that the model with effects predicts for itself: filter uncertainty at the start, process noise "
      "over the horizon and tracker noise, all estimated from one-step innovations; what persists from one "
      "innovation to the next does not count as noise");
  if (f.replicates) {
    identification::Replicates& replicates = *out.mutable_replicates();
    replicates.set_floor_mm(f.replicates->floor_mm);
    replicates.set_repeatable_mm(f.replicates->repeatable_mm);
    replicates.set_groups(static_cast<std::uint32_t>(f.replicates->groups));
    replicates.set_windows(static_cast<std::uint32_t>(f.replicates->windows));
  }
  out.set_horizon_s(horizon_s);
}

identification::Result result_of(const Findings& f, const MeasuredSet& judged, double horizon_s) {
  const MotionModel& after = f.found.fit.model;
  identification::Result out;
  add_errors(out, f, horizon_s);
  *out.mutable_effects() = effects_of(f);
  if (f.stalls) *out.add_effects() = entry_of(*f.stalls);
  for (const NoiseEffect& effect : f.noise_effects) *out.add_effects() = entry_of(effect);
  if (const double lag_s = after.base.command_lag_s; lag_s != 0) {
    out.mutable_command_lag()->set_lag_s(lag_s);
    if (f.command_lag_s) {
      const auto [low_s, high_s] = *f.command_lag_s;
      if (std::isfinite(low_s)) out.mutable_command_lag()->set_low_s(low_s);
      if (std::isfinite(high_s)) out.mutable_command_lag()->set_high_s(high_s);
    }
    out.mutable_command_lag()->set_in_words(
        fmt::format("The tracks follow the commands {:.3f} s {} than stamped. The fit allows for it; check the "
                    "clocks of tracker and commands.",
                    std::abs(lag_s), lag_s > 0 ? "later" : "earlier"));
  }
  *out.mutable_numbering() = entry_of(f.numbering);
  *out.mutable_check() = check_of(f);
  out.mutable_search()->set_work(static_cast<double>(f.found.work));
  out.mutable_search()->set_limit(f.found.limit);
  *out.mutable_unexplained() = unexplained_of(f.unexplained);
  out.set_next(next_step(f));
  for (const Rejected& r : f.found.rejected) *out.add_rejected() = rejected_of(r);
  for (const Ambiguity& a : f.found.ambiguous) *out.add_ambiguous() = ambiguous_of(a);
  *out.mutable_base() = base_of(after.base);
  *out.mutable_base_sd() = base_sd_of(f.uncertainty);
  *out.mutable_disc_centre() = disc_centre_of(after, f.geometry);
  add_robots(out, f, judged);
  *out.mutable_noise() = noise_of(after.noise);
  *out.mutable_noise_low() = noise_of(f.noise.low);
  *out.mutable_noise_high() = noise_of(f.noise.high);
  *out.mutable_walls() = walls_of(after.walls);
  *out.mutable_walls_low() = walls_of(f.geometry.low);
  *out.mutable_walls_high() = walls_of(f.geometry.high);
  return out;
}

}  // namespace

identification::Identification document_of(const Findings& f, const MeasuredSet& train, const MeasuredSet* test,
                                           double horizon_s, std::uint32_t threads) {
  identification::Identification out;
  *out.mutable_result() = result_of(f, test != nullptr ? *test : train, horizon_s);
  const MotionModel& model = f.found.fit.model;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const std::vector<proto::Effect> written = effects_of_term(model.terms[t]);
    for (identification::EffectCurve& curve : curves_of(model.terms[t].name, written)) {
      set_band(curve, model, t, f.uncertainty, f.steps);
      *out.add_effect_curves() = std::move(curve);
    }
    for (identification::EffectMap& map : maps_of(model.terms[t].name, written)) {
      set_band(map, model, t, f.uncertainty, f.steps);
      *out.add_effect_maps() = std::move(map);
    }
  }
  *out.mutable_set() = describe_set(train, test, f.held_out);
  for (const Step& step : f.found.steps) {
    identification::Step& added = *out.add_steps();
    added.set_added(step.added);
    added.set_held_out_gain(step.held_out);
  }
  add_residual_plots(out, disturbances_of(f.base, threads), disturbances_of(f.found.fit, threads));
  return out;
}

void add_faults(identification::Result& out, const std::vector<DataFault>& faults) {
  for (const DataFault& f : faults) {
    identification::Fault& fault = *out.add_faults();
    fault.set_kind(name_of(f.kind));
    fault.set_set(f.of_test ? "test" : "train");
    fault.set_run(f.run);
    *fault.mutable_robot() = json_value(f.robot);
    *fault.mutable_other() = json_value(f.other);
    fault.set_from_s(f.from_s);
    fault.set_to_s(f.to_s);
    fault.set_strength(f.strength);
    fault.set_excluded(f.of_test ? 0 : static_cast<std::uint32_t>(f.excluded));
    fault.set_in_words(f.in_words());
  }
}

}  // namespace kilotwin::identify

#include "clients/identify/document.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "clients/identify/bands.hpp"
#include "clients/identify/fit/residuals.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/effect_text.hpp"
#include "clients/identify/predict/final_check.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

/// Root mean square error, with its 95 % interval if known; null if nothing is held out.
json summary_of(const PredictionErrors& errors, const std::optional<ErrorBounds>& bounds,
                Interval ErrorBounds::*which) {
  json out = {{"rmse_mm", errors.rows > 0 ? json(errors.rmse_mm()) : json()}, {"rows", errors.rows}};
  if (bounds) {
    out["rmse_low_mm"] = ((*bounds).*which).low_mm;
    out["rmse_high_mm"] = ((*bounds).*which).high_mm;
  }
  return out;
}

/// Reduction of the error.
json improvement_of(const PredictionErrors& before, const PredictionErrors& after,
                    const std::optional<ErrorBounds>& bounds) {
  if (before.rows == 0) return json::object();
  json out = {{"less_by_mm", before.rmse_mm() - after.rmse_mm()}};
  if (bounds) {
    out["low_mm"] = bounds->less_by.low_mm;
    out["high_mm"] = bounds->less_by.high_mm;
    out["bounds_how"] =
        fmt::format("95 %, by a bootstrap over {}{}", bounds->runs > 1 ? "robots and runs" : "robots",
                    bounds->runs > 1 ? fmt::format(", {} robots and {} runs", bounds->robots, bounds->runs)
                                     : fmt::format(": {} robots in one run", bounds->robots));
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

/// The most useful thing to do next, as one sentence.
std::string next_step(const Findings& f) {
  if (f.held_out == HeldOut::kNothing)
    return "Measure a second run, or at least four robots, so that held-out data can confirm the effects.";
  if (f.held_out == HeldOut::kNoTime) return "Measure longer runs, so that predictions can be compared with them.";
  if (f.numbering.anew())
    return "Give each robot the same number in all runs, or other numbers in each run, and identify again.";
  if (!f.check.dropped.empty())
    return "Find out what differed between the data of the fit and the held-out data: an effect held in the former "
           "only.";
  if (f.unexplained.large())
    return f.replicates
               ? "Look for the cause of what is left unexplained, in the covariates that it varies with."
               : "Repeat the commands of one run, so that repetitions show how much can be explained at all.";
  if (!f.found.ambiguous.empty()) {
    const Ambiguity& a = f.found.ambiguous.front();
    return fmt::format("To tell {} from {}: {}.", a.found, a.instead,
                       experiment_for(a.found_covariates, a.covariates));
  }
  return fmt::format("Use the model: kilotwin run EXPERIMENT --model {}", f.model_file);
}

/// A covariate of result.json, as words.
std::string in_words(const std::string& covariate) {
  static const std::map<std::string, std::string> kWords = {{"motor_time", "motor-on time"},
                                                            {"time_since_command", "time since the command"},
                                                            {"world_frame", "the directions of the arena"},
                                                            {"measurement", "the camera"}};
  const auto at = kWords.find(covariate);
  return at == kWords.end() ? covariate : at->second;
}

/// Share of the reduction of the mean square error that is lost without a term.
double share_removed(const Findings& f, double without_mm) {
  const double before_mm = f.before.errors.rmse_mm(), after_mm = f.after.errors.rmse_mm(),
               gap = before_mm * before_mm - after_mm * after_mm;
  if (gap <= 0) return 0;
  return std::clamp((without_mm * without_mm - after_mm * after_mm) / gap, 0.0, 1.0);
}

json effect_of(const Findings& f, std::size_t t) {
  const Term& term = f.found.fit.model.terms[t];
  const Reason& reason = f.found.reasons[t];
  const std::vector<proto::Effect> written = effects_of_term(term);
  json records = json::array();
  for (const proto::Effect& effect : written) records.push_back(effect.ShortDebugString());
  const std::string size = size_in_words(written);
  std::vector<std::string> covariates;
  for (const std::string& covariate : reason.covariates) covariates.push_back(in_words(covariate));
  const bool judged = !f.rmse_without_mm.empty(), chosen = !f.check.gains.empty();
  const HeldOutGain gain = chosen ? f.check.gains[t] : HeldOutGain{};
  return {
      {"name", term.name},
      {"covariates", reason.covariates},
      {"acts_on", reason.acts_on},
      {"evidence",
       {{"log10_p", reason.finding.log10_p},
        {"threshold_log10_p", reason.threshold_log10_p},
        {"p_family",
         std::min(1.0, ScoreTest::kFamilyAlarm *
                           std::pow(10.0, std::max(-300.0, reason.finding.log10_p - reason.threshold_log10_p)))},
        {"log_likelihood_gain", reason.finding.evidence},
        {"held_out_gain", chosen ? json(gain.nat) : json()},
        {"held_out_gain_se", chosen ? json(gain.nat_se) : json()},
        {"degrees", reason.finding.degrees}}},
      {"parameters",
       {{"form", form_of(term)},
        {"columns", term.coefficients.size()},
        {"records", records},
        {"bands_95", bands_of(f.found.fit.model, t, f.uncertainty)}}},
      {"rmse_without_mm", judged ? json(f.rmse_without_mm[t]) : json()},
      {"share_removed", judged ? json(share_removed(f, f.rmse_without_mm[t])) : json()},
      {"in_words", fmt::format("{} depends on {}{}{}", reason.acts_on, fmt::join(covariates, ", "),
                               size.empty() ? "" : ": ", size)}};
}

/// Takes the shares of the effects out if they do not add up, as with effects that overlap.
void keep_shares_that_add_up(json& effects) {
  double sum = 0;
  for (const json& effect : effects)
    if (effect["share_removed"].is_number()) sum += effect["share_removed"].get<double>();
  constexpr double kOff = 0.1;
  if (effects.size() < 2 || std::abs(sum - 1) < kOff) return;
  for (json& effect : effects) effect["share_removed"] = nullptr;
}

/// One entry per effect. Terms of one name share an entry, with the largest loss among them.
json effects_of(const Findings& f) {
  json effects = json::array();
  for (std::size_t t = 0; t < f.found.fit.model.terms.size(); ++t) {
    json effect = effect_of(f, t);
    const auto known =
        std::find_if(effects.begin(), effects.end(), [&](const json& e) { return e["name"] == effect["name"]; });
    if (known == effects.end()) {
      effects.push_back(std::move(effect));
      continue;
    }
    if (f.rmse_without_mm.empty()) continue;
    if ((*known)["rmse_without_mm"] < effect["rmse_without_mm"])
      (*known)["rmse_without_mm"] = effect["rmse_without_mm"];
    json &evidence = (*known)["evidence"], &other = effect["evidence"];
    if (evidence["held_out_gain"] < other["held_out_gain"]) {
      for (const char* key : {"held_out_gain", "held_out_gain_se"}) evidence[key] = other[key];
    }
  }
  keep_shares_that_add_up(effects);
  std::stable_sort(effects.begin(), effects.end(), [](const json& a, const json& b) {
    return a["evidence"]["log_likelihood_gain"].get<double>() > b["evidence"]["log_likelihood_gain"].get<double>();
  });
  return effects;
}

json describe_set(const MeasuredSet& train, const MeasuredSet* test, HeldOut held_out) {
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
  return {{"runs", train.runs.size()},
          {"robots", train.robots().size()},
          {"tracks", train.tracks()},
          {"samples", train.samples()},
          {"test_samples", test != nullptr ? test->samples() : 0},
          {"has_headings", train.has_headings},
          {"has_commands", train.has_commands},
          {"duration_s", duration_s},
          {"sample_s", steps.empty() ? 0 : steps[steps.size() / 2]},
          {"held_out", name_of(held_out)}};
}

json rejected_of(const Search& found) {
  json out = json::array();
  for (const Rejected& r : found.rejected) {
    out.push_back({{"name", r.name},
                   {"covariates", r.covariates},
                   {"acts_on", r.acts_on},
                   {"log10_p", r.log10_p},
                   {"threshold_log10_p", r.threshold_log10_p}});
    if (!r.why.empty()) out.back()["why"] = r.why;
  }
  return out;
}

json ambiguous_of(const Search& found) {
  json out = json::array();
  for (const Ambiguity& a : found.ambiguous) {
    out.push_back({{"found", a.found},
                   {"instead", a.instead},
                   {"experiment", experiment_for(a.found_covariates, a.covariates)},
                   {"log_likelihood_difference", a.evidence_difference}});
  }
  return out;
}

json base_of(const BaseParameters& base) {
  return {{"straight_speed_mm_s", base.straight_mm_s}, {"turn_speed_mm_s", base.turn_mm_s},
          {"wheel_base_mm", base.wheel_base_mm},       {"tracked_point_ahead_mm", base.ahead_mm},
          {"tracked_point_left_mm", base.left_mm},     {"disc_centre_ahead_mm", base.centre_mm},
          {"bias_mean_mm_s", base.bias_mean_mm_s},     {"bias_sd_mm_s", base.bias_sd_mm_s},
          {"command_lag_s", base.command_lag_s}};
}

json numbering_of(const Numbering& numbering) {
  json out = {{"anew_in_each_run", numbering.anew()}, {"spread", numbering.spread}, {"chance", numbering.chance}};
  if (numbering.anew())
    out["in_words"] =
        "Robots seem to be numbered anew in each run: they differ in speed, but a number does not have the same "
        "speed in all runs.";
  return out;
}

/// Standard deviations of the base parameters.
json base_sd_of(const Uncertainty& u) {
  return {{"straight_speed_mm_s", u.sd(kStraightSpeed)},
          {"turn_speed_mm_s", u.sd(kTurnSpeed)},
          {"wheel_base_mm", u.sd(kWheelBase)},
          {"tracked_point_ahead_mm", u.sd(kAheadPoint)},
          {"tracked_point_left_mm", u.sd(kLeftPoint)}};
}

/// Where contacts and walls act, and what the data say about it.
json disc_centre_of(const MotionModel& model) {
  constexpr double kSame_mm = 3, kTold = 3;
  const bool tracked = std::abs(model.base.centre_mm - model.base.ahead_mm) < kSame_mm;
  const std::string where =
      tracked ? "at the tracked point"
              : fmt::format("{:.1f} mm ahead of the drive's reference point", model.base.centre_mm);
  const double evidence = model.centre_evidence;
  const std::string why = evidence == 0 ? "assumed: these data do not tell it"
                          : evidence > kTold
                              ? fmt::format("told by contacts, by {:.0f} nat of log likelihood", evidence)
                              : std::string("told by how near robots come to each other");
  return {{"ahead_mm", model.base.centre_mm},
          {"at_tracked_point", tracked},
          {"log_likelihood_over_alternative", evidence},
          {"in_words", fmt::format("Contacts and walls act {} ({}).", where, why)}};
}

json noise_of(const Noise& noise) {
  return {{"factor_variance_s", noise.factor_s},
          {"wheel_sd_mm", std::sqrt(noise.wheel_mm2_s)},
          {"heading_sd_rad", std::sqrt(noise.heading_rad2_s)},
          {"drift_sd_mm", std::sqrt(noise.drift_mm2_s)},
          {"tracker_position_sd_mm", std::sqrt(noise.position_mm2)},
          {"tracker_heading_sd_rad", std::sqrt(noise.heading_rad2)},
          {"at_walls_sd_mm", std::sqrt(noise.wall_mm2_s)},
          {"at_walls_sd_rad", std::sqrt(noise.wall_rad2_s)},
          {"at_robots_sd_mm", std::sqrt(noise.contact_mm2_s)},
          {"at_robots_sd_rad", std::sqrt(noise.contact_rad2_s)}};
}

/// Lines that disc centres do not cross. A side without an entry has no wall.
json walls_of(const Walls& walls) {
  json out = json::object();
  for (const auto& [side, at_mm] : {std::pair{"x_low_mm", walls.x_low_mm},
                                    {"x_high_mm", walls.x_high_mm},
                                    {"y_low_mm", walls.y_low_mm},
                                    {"y_high_mm", walls.y_high_mm}}) {
    if (std::isfinite(at_mm)) out[side] = at_mm;
  }
  return out;
}

json check_of(const FinalCheck& check) {
  json path = json::array();
  for (const CheckedModel& model : check.path)
    path.push_back({{"effects", model.effects}, {"rmse_mm", model.rmse_mm}});
  return {{"path", path}, {"kept", check.kept}, {"dropped", check.dropped}};
}

/// What a reader must know about the errors and the search; empty: nothing.
std::string caveats_of(const Findings& f) {
  std::vector<std::string> sentences;
  const double before_mm = f.before.errors.rmse_mm(), after_mm = f.after.errors.rmse_mm();
  const bool has_effects = !f.found.fit.model.terms.empty();
  if (has_effects && f.bounds && f.bounds->less_by.high_mm < 0)
    sentences.push_back(fmt::format(
        "With effects the error on these data is larger than that of the base model ({:.2f} mm, {:.2f} mm), beyond "
        "chance: they differ from the data of the fit.",
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

/// [row][column]; null where there are no data.
json rows_of(const Eigen::MatrixXd& values) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index j = 0; j < values.cols(); ++j)
      row.push_back(std::isnan(values(i, j)) ? json() : json(values(i, j)));
    rows.push_back(std::move(row));
  }
  return rows;
}

json pattern_of(const Pattern& p) {
  json covariates = json::array(), units = json::array();
  for (const Feature f : p.over) {
    covariates.push_back(name_of(f));
    units.push_back(unit_of(f));
  }
  return {{"covariates", covariates},
          {"units", units},
          {"components", p.in_body ? json{"ahead", "left"} : json{"x", "y"}},
          {"share", p.share},
          {"at", p.at},
          {"and_at", p.and_at},
          {"first_mm", rows_of(p.first_mm)},
          {"second_mm", rows_of(p.second_mm)}};
}

json unexplained_of(const Unexplained& u) {
  json patterns = json::array();
  for (const Pattern& p : u.patterns) patterns.push_back(pattern_of(p));
  json out = {{"large", u.large()},
              {"systematic_mm", u.systematic_mm},
              {"share", u.share},
              {"expected_mm", u.expected_mm},
              {"repetitions_mm", u.repetitions_mm ? json(*u.repetitions_mm) : json()},
              {"learner", nullptr},
              {"patterns", patterns},
              {"in_words", u.in_words}};
  if (u.learner)
    out["learner"] = {{"error_mm", u.learner->error_mm},
                      {"error_left_mm", u.learner->error_left_mm},
                      {"less_by_low_mm", u.learner->less_by_mm.low_mm},
                      {"less_by_high_mm", u.learner->less_by_mm.high_mm},
                      {"cross_validated", u.learner->cross_validated}};
  return out;
}

json robots_of(const Findings& f, const MeasuredSet& judged) {
  json robots = json::array();
  std::map<std::uint32_t, std::array<double, 3>> by_robot;
  for (const Judged* side : {&f.before, &f.after}) {
    for (const auto& [track, part] : side->errors.by_track) {
      auto& sums = by_robot[judged.runs[track.first].tracks[track.second].robot];
      sums[side == &f.before ? 0 : 1] += part.sum_mm2;
      if (side == &f.before) sums[2] += static_cast<double>(part.rows);
    }
  }
  for (const auto& [robot, bias] : f.found.fit.model.robots) {
    json entry = {{"robot", robot},
                  {"bias_left_mm_s", bias.mean_mm_s[0]},
                  {"bias_right_mm_s", bias.mean_mm_s[1]},
                  {"sd_left_mm_s", std::sqrt(bias.covariance(0, 0))},
                  {"sd_right_mm_s", std::sqrt(bias.covariance(1, 1))}};
    if (const auto known = f.uncertainty.biases.find(robot); known != f.uncertainty.biases.end()) {
      entry["sd_left_mm_s"] = std::sqrt(known->second(0, 0));
      entry["sd_right_mm_s"] = std::sqrt(known->second(1, 1));
    }
    if (const auto sums = by_robot.find(robot); sums != by_robot.end() && sums->second[2] > 0) {
      entry["before_mm"] = std::sqrt(sums->second[0] / sums->second[2]);
      entry["after_mm"] = std::sqrt(sums->second[1] / sums->second[2]);
    }
    robots.push_back(entry);
  }
  return robots;
}

json contract_of(const Findings& f, const MeasuredSet& judged, double horizon_s) {
  const MotionModel& after = f.found.fit.model;
  json contract;
  contract["before"] = summary_of(f.before.errors, f.bounds, &ErrorBounds::before);
  contract["after"] = summary_of(f.after.errors, f.bounds, &ErrorBounds::after);
  if (f.before.errors.rows > 0)
    contract["free"] = {
        {"before_mm", f.free_before.rows > 0 ? json(f.free_before.rmse_mm()) : json()},
        {"after_mm", f.free_after.rows > 0 ? json(f.free_after.rmse_mm()) : json()},
        {"rows", f.free_after.rows},
        {"share_of_rows", static_cast<double>(f.free_after.rows) / static_cast<double>(f.before.errors.rows)}};
  contract["improvement"] = improvement_of(f.before.errors, f.after.errors, f.bounds);
  contract["held_out"] = {{"kind", name_of(f.held_out)}, {"in_words", identify::in_words(f.held_out)}};
  contract["noise_floor_mm"] = f.expected_mm;
  contract["noise_floor_how"] =
      "the error that the model with effects predicts for itself: filter uncertainty at the start, process noise "
      "over the horizon and tracker noise, all estimated from one-step innovations; what persists from one "
      "innovation "
      "to the next does not count as noise";
  if (f.replicates) {
    contract["replicates"] = {{"floor_mm", f.replicates->floor_mm},
                              {"repeatable_mm", f.replicates->repeatable_mm},
                              {"groups", f.replicates->groups},
                              {"windows", f.replicates->windows}};
  }
  contract["horizon_s"] = horizon_s;
  contract["effects"] = effects_of(f);
  if (const double lag_s = after.base.command_lag_s; lag_s != 0)
    contract["command_lag"] = {
        {"lag_s", lag_s},
        {"in_words",
         fmt::format("The tracks follow the commands {:.3f} s {} than stamped. The fit allows for it; check the "
                     "clocks of tracker and commands.",
                     std::abs(lag_s), lag_s > 0 ? "later" : "earlier")}};
  contract["numbering"] = numbering_of(f.numbering);
  contract["check"] = check_of(f.check);
  if (const std::string caveats = caveats_of(f); !caveats.empty()) contract["check"]["in_words"] = caveats;
  contract["search"] = {{"work", f.found.work}, {"limit", f.found.limit}};
  contract["unexplained"] = unexplained_of(f.unexplained);
  contract["next"] = next_step(f);
  contract["rejected"] = rejected_of(f.found);
  contract["ambiguous"] = ambiguous_of(f.found);
  contract["base"] = base_of(after.base);
  contract["base_sd"] = base_sd_of(f.uncertainty);
  contract["disc_centre"] = disc_centre_of(after);
  contract["robots"] = robots_of(f, judged);
  contract["noise"] = noise_of(after.noise);
  contract["walls"] = walls_of(after.walls);
  return contract;
}

}  // namespace

json document_of(const Findings& f, const MeasuredSet& train, const MeasuredSet* test, double horizon_s,
                 std::uint32_t threads) {
  const MeasuredSet& judged = test != nullptr ? *test : train;
  json document;
  document["contract"] = contract_of(f, judged, horizon_s);
  document["robots"] = document["contract"]["robots"];
  document["effect_curves"] = document["effect_maps"] = json::array();
  for (const Term& term : f.found.fit.model.terms) {
    const std::vector<proto::Effect> written = effects_of_term(term);
    for (json& curve : curves_of(term.name, written)) document["effect_curves"].push_back(std::move(curve));
    for (json& map : maps_of(term.name, written)) document["effect_maps"].push_back(std::move(map));
  }
  document["set"] = describe_set(train, test, f.held_out);
  document["steps"] = json::array();
  for (const Step& step : f.found.steps)
    document["steps"].push_back({{"added", step.added}, {"held_out_gain", step.held_out}});
  const std::vector<Disturbance> left_before = disturbances_of(f.base, threads),
                                 left_after = disturbances_of(f.found.fit, threads);
  document["covariate_plots"] = covariate_plots(left_before, left_after);
  document["maps"] = maps(left_before, left_after);
  return document;
}

}  // namespace kilotwin::identify

#include "clients/identify/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/residuals.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "clients/identify/model/effect_text.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/predict/forecast.hpp"
#include "clients/identify/predict/held_out_gain.hpp"
#include "clients/identify/predict/prediction_errors.hpp"
#include "clients/identify/replay/simulation_check.hpp"
#include "clients/identify/search/search.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

/// Root mean square error, with its 95 % interval if known.
json summary_of(const PredictionErrors& errors, const std::optional<ErrorBounds>& bounds,
                Interval ErrorBounds::*which) {
  json out = {{"rmse_mm", errors.rmse_mm()}, {"rows", errors.rows}};
  if (bounds) {
    out["rmse_low_mm"] = ((*bounds).*which).low_mm;
    out["rmse_high_mm"] = ((*bounds).*which).high_mm;
  }
  return out;
}

/// Reduction of the error.
json improvement_of(const PredictionErrors& before, const PredictionErrors& after,
                    const std::optional<ErrorBounds>& bounds) {
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

/// Evaluation of the model without one term, refitted, on held-out data.
struct Without {
  double rmse_mm;
  HeldOutGain gain;  ///< of the model with the term over the one without
};

/// One entry per effect. Terms of one name share an entry, with the largest loss among them.
json effects_of(const Search& found, const std::vector<Without>& without, double before_mm, double after_mm) {
  json effects = json::array();
  for (std::size_t t = 0; t < found.model.terms.size(); ++t) {
    const Term& term = found.model.terms[t];
    const Reason& reason = found.reasons[t];
    const auto known =
        std::find_if(effects.begin(), effects.end(), [&](const json& e) { return e["name"] == term.name; });
    if (known != effects.end()) {
      (*known)["rmse_without_mm"] = std::max((*known)["rmse_without_mm"].get<double>(), without[t].rmse_mm);
      if (json& evidence = (*known)["evidence"]; without[t].gain.nat > evidence["held_out_gain"].get<double>()) {
        evidence["held_out_gain"] = without[t].gain.nat;
        evidence["held_out_gain_se"] = without[t].gain.nat_se;
      }
      continue;
    }
    const double gap = before_mm * before_mm - after_mm * after_mm;
    const double share = gap > 0 ? (without[t].rmse_mm * without[t].rmse_mm - after_mm * after_mm) / gap : 0;
    const std::vector<proto::Effect> written = effects_of_term(term);
    json records = json::array();
    for (const proto::Effect& effect : written) records.push_back(effect.ShortDebugString());
    const std::string size = size_in_words(written);
    effects.push_back(
        {{"name", term.name},
         {"covariates", reason.covariates},
         {"acts_on", reason.acts_on},
         {"evidence",
          {{"log10_p", reason.finding.log10_p},
           {"threshold_log10_p", reason.threshold_log10_p},
           {"p_family",
            std::min(1.0, ScoreTest::kFamilyAlarm *
                              std::pow(10.0, std::max(-300.0, reason.finding.log10_p - reason.threshold_log10_p)))},
           {"log_likelihood_gain", reason.finding.evidence},
           {"held_out_gain", without[t].gain.nat},
           {"held_out_gain_se", without[t].gain.nat_se},
           {"degrees", reason.finding.degrees}}},
         {"parameters", {{"form", form_of(term)}, {"columns", term.coefficients.size()}, {"records", records}}},
         {"rmse_without_mm", without[t].rmse_mm},
         {"share_removed", std::clamp(share, 0.0, 1.0)},
         {"in_words", fmt::format("{} depends on {}{}{}", reason.acts_on, fmt::join(reason.covariates, ", "),
                                  size.empty() ? "" : ": ", size)}});
  }
  std::stable_sort(effects.begin(), effects.end(), [](const json& a, const json& b) {
    return a["evidence"]["log_likelihood_gain"].get<double>() > b["evidence"]["log_likelihood_gain"].get<double>();
  });
  return effects;
}

json describe_set(const MeasuredSet& train, const MeasuredSet* test, bool held_out) {
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
          {"held_out", held_out}};
}

}  // namespace

void hold_out_part(MeasuredSet& set) {
  if (set.runs.size() >= 3) {
    const std::size_t keep = set.runs.size() - std::max<std::size_t>(1, set.runs.size() / 4);
    for (std::size_t r = keep; r < set.runs.size(); ++r)
      for (Track& track : set.runs[r].tracks) track.held_out = true;
    return;
  }
  const std::vector<std::uint32_t> robots = set.robots();
  for (Run& run : set.runs) {
    for (Track& track : run.tracks) {
      const auto place = std::lower_bound(robots.begin(), robots.end(), track.robot) - robots.begin();
      track.held_out = robots.size() >= 4 ? place % 4 == 3 : set.runs.size() == 2 && &run == &set.runs.back();
    }
  }
}

Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options& options) {
  const auto say_progress = [&](double part, const std::string& what) {
    if (options.progress) options.progress(part, what);
  };
  const auto started = std::chrono::steady_clock::now();
  PreparedSet prepared(train);
  if (prepared.units().empty())
    throw UserError("no track of the training runs has two samples; give longer tracks");
  std::optional<PreparedSet> other;
  if (test != nullptr) other.emplace(*test, static_cast<std::uint32_t>(train.runs.size()));
  PreparedSet& judged = other ? *other : prepared;
  const bool held_out_only = !other && std::any_of(train.runs.begin(), train.runs.end(), [](const Run& run) {
    return std::any_of(run.tracks.begin(), run.tracks.end(), [](const Track& t) { return t.held_out; });
  });

  say_progress(0.02, "base model");
  Fitter fitter(prepared, options.threads);
  MotionModel before;
  fitter.fit_base(before);
  if (other) other->find_centres(before, options.threads);

  Search found;
  found.model = before;
  if (options.find_effects) {
    found = search(fitter, before,
                   [&](double part, const std::string& what) { say_progress(0.1 + 0.75 * part, what); });
  }
  const ForecastTimes forecast_times{10, 5, options.horizon_s};
  // A term stays only if it reduces the error at the prediction horizon. A small p one step ahead does not
  // suffice.
  const auto fitted_mm = [&](const MotionModel& model) {
    return errors_of(train, forecast(model, prepared, forecast_times, false, options.threads)).rmse_mm();
  };
  if (!found.model.terms.empty()) {
    say_progress(0.86, "evaluating each effect");
    double with_mm = fitted_mm(found.model);
    for (std::size_t t = found.model.terms.size(); t-- > 0;) {
      MotionModel without = found.model;
      without.terms.erase(without.terms.begin() + static_cast<std::ptrdiff_t>(t));
      fitter.fit(without, 1);
      const double without_mm = fitted_mm(without);
      // Measurement effects rarely change predicted positions, so they need not reduce the error. They must not
      // raise it.
      const bool on_measurement = is_measured(found.model.terms[t].blocks.front().target);
      if (without_mm > with_mm * (on_measurement ? 0.9995 : 1.0005)) continue;
      found.model = without;
      found.reasons.erase(found.reasons.begin() + static_cast<std::ptrdiff_t>(t));
      with_mm = without_mm;
    }
  }
  const MotionModel& after = found.model;
  if (other) other->find_centres(after, options.threads);
  json document;

  say_progress(0.9, "predictions");
  ForecastTimes final = forecast_times;
  final.rollouts = 64;
  const std::vector<Forecast> forecast_before = forecast(before, judged, final, held_out_only, options.threads);
  const std::vector<Forecast> forecast_after = forecast(after, judged, final, held_out_only, options.threads);

  Identified out;
  for (std::size_t i = 0; i < forecast_before.size(); ++i) {
    const Forecast &b = forecast_before[i], &a = forecast_after[i];
    KILOTWIN_DEMAND(b.run == a.run && b.place == a.place && b.time_s == a.time_s);
    const Run& run = judged.set().runs[b.run];
    out.predictions.push_back({run.name, run.tracks[b.place].robot, b.time_s, b.x_mm, b.y_mm, a.x_mm, a.y_mm});
  }
  const PredictionErrors errors_before = errors_of(judged.set(), forecast_before),
                         errors_after = errors_of(judged.set(), forecast_after);
  const std::optional<ErrorBounds> bounds = bounds_of(judged.set(), errors_before, errors_after);
  json& contract = document["contract"];
  contract["before"] = summary_of(errors_before, bounds, &ErrorBounds::before);
  contract["after"] = summary_of(errors_after, bounds, &ErrorBounds::after);
  contract["improvement"] = improvement_of(errors_before, errors_after, bounds);
  contract["noise_floor_mm"] = errors_after.expected_mm();
  contract["noise_floor_how"] =
      "the error that the model with effects predicts for itself: filter uncertainty at the start, process noise "
      "over the "
      "horizon and tracker noise, all estimated from one-step innovations";
  {
    const std::vector<Forecast> fitted = forecast(after, prepared, forecast_times, false, options.threads);
    std::vector<std::pair<const MeasuredSet*, const std::vector<Forecast>*>> all{{&train, &fitted}};
    if (other) all.emplace_back(test, &forecast_after);
    if (const std::optional<Replicates> again = replicates_of(all, options.horizon_s)) {
      contract["replicates"] = {{"floor_mm", again->floor_mm},
                                {"repeatable_mm", again->repeatable_mm},
                                {"groups", again->groups},
                                {"windows", again->windows}};
    }
  }
  contract["horizon_s"] = options.horizon_s;
  std::vector<Without> without;
  for (std::size_t t = 0; t < after.terms.size(); ++t) {
    MotionModel less = after;
    less.terms.erase(less.terms.begin() + static_cast<std::ptrdiff_t>(t));
    fitter.fit(less, 1);
    without.push_back(
        {errors_of(judged.set(), forecast(less, judged, forecast_times, held_out_only, options.threads)).rmse_mm(),
         held_out_gain(after, less, judged, held_out_only, options.threads)});
  }
  contract["effects"] = effects_of(found, without, errors_before.rmse_mm(), errors_after.rmse_mm());
  document["effect_curves"] = document["effect_maps"] = json::array();
  for (const Term& term : after.terms) {
    const std::vector<proto::Effect> written = effects_of_term(term);
    for (json& curve : curves_of(term.name, written)) document["effect_curves"].push_back(std::move(curve));
    for (json& map : maps_of(term.name, written)) document["effect_maps"].push_back(std::move(map));
  }
  contract["rejected"] = json::array();
  for (const Rejected& r : found.rejected) {
    contract["rejected"].push_back({{"name", r.name},
                                    {"covariates", r.covariates},
                                    {"acts_on", r.acts_on},
                                    {"log10_p", r.log10_p},
                                    {"threshold_log10_p", r.threshold_log10_p}});
  }
  contract["ambiguous"] = json::array();
  for (const Ambiguity& a : found.ambiguous) {
    contract["ambiguous"].push_back({{"found", a.found},
                                     {"instead", a.instead},
                                     {"experiment", experiment_for(a.found_covariates, a.covariates)},
                                     {"log_likelihood_difference", a.evidence_difference}});
  }
  contract["base"] = {
      {"straight_speed_mm_s", after.base.straight_mm_s}, {"turn_speed_mm_s", after.base.turn_mm_s},
      {"wheel_base_mm", after.base.wheel_base_mm},       {"tracked_point_ahead_mm", after.base.ahead_mm},
      {"tracked_point_left_mm", after.base.left_mm},     {"disc_centre_ahead_mm", after.base.centre_mm},
      {"bias_mean_mm_s", after.base.bias_mean_mm_s},     {"bias_sd_mm_s", after.base.bias_sd_mm_s}};
  contract["noise"] = {{"factor_variance_s", after.noise.factor_s},
                       {"wheel_sd_mm", std::sqrt(after.noise.wheel_mm2_s)},
                       {"heading_sd_rad", std::sqrt(after.noise.heading_rad2_s)},
                       {"drift_sd_mm", std::sqrt(after.noise.drift_mm2_s)},
                       {"tracker_position_sd_mm", std::sqrt(after.noise.position_mm2)},
                       {"tracker_heading_sd_rad", std::sqrt(after.noise.heading_rad2)},
                       {"at_walls_sd_mm", std::sqrt(after.noise.wall_mm2_s)},
                       {"at_walls_sd_rad", std::sqrt(after.noise.wall_rad2_s)},
                       {"at_robots_sd_mm", std::sqrt(after.noise.contact_mm2_s)},
                       {"at_robots_sd_rad", std::sqrt(after.noise.contact_rad2_s)}};
  // Lines that disc centres do not cross. A side without an entry has no wall.
  contract["walls"] = json::object();
  for (const auto& [side, at_mm] :
       {std::pair{"x_low_mm", after.walls.x_low_mm}, std::pair{"x_high_mm", after.walls.x_high_mm},
        std::pair{"y_low_mm", after.walls.y_low_mm}, std::pair{"y_high_mm", after.walls.y_high_mm}}) {
    if (std::isfinite(at_mm)) contract["walls"][side] = at_mm;
  }
  document["set"] = describe_set(train, test, held_out_only);
  document["steps"] = json::array();
  for (const Step& step : found.steps)
    document["steps"].push_back({{"added", step.added}, {"held_out_gain", step.held_out}});
  document["robots"] = json::array();
  std::map<std::uint32_t, std::array<double, 3>> by_robot;
  for (const auto* errors : {&errors_before, &errors_after}) {
    for (const auto& [track, part] : errors->by_track) {
      auto& sums = by_robot[judged.set().runs[track.first].tracks[track.second].robot];
      sums[errors == &errors_before ? 0 : 1] += part.sum_mm2;
      if (errors == &errors_before) sums[2] += static_cast<double>(part.rows);
    }
  }
  for (const auto& [robot, bias] : after.robots) {
    json entry = {{"robot", robot},
                  {"bias_left_mm_s", bias.mean_mm_s[0]},
                  {"bias_right_mm_s", bias.mean_mm_s[1]},
                  {"sd_left_mm_s", std::sqrt(bias.covariance(0, 0))},
                  {"sd_right_mm_s", std::sqrt(bias.covariance(1, 1))}};
    if (const auto sums = by_robot.find(robot); sums != by_robot.end() && sums->second[2] > 0) {
      entry["before_mm"] = std::sqrt(sums->second[0] / sums->second[2]);
      entry["after_mm"] = std::sqrt(sums->second[1] / sums->second[2]);
    }
    document["robots"].push_back(entry);
  }
  say_progress(0.92, "errors over the horizon");
  json& curve = document["horizon"];
  for (const double ahead_s : {1.0, 2.0, 5.0, 10.0, 15.0, 20.0}) {
    const ForecastTimes at{20, 10, ahead_s};
    const PredictionErrors was =
        errors_of(judged.set(), forecast(before, judged, at, held_out_only, options.threads));
    const PredictionErrors is =
        errors_of(judged.set(), forecast(after, judged, at, held_out_only, options.threads));
    curve["at_s"].push_back(ahead_s);
    curve["before_mm"].push_back(was.rmse_mm());
    curve["after_mm"].push_back(is.rmse_mm());
    curve["floor_mm"].push_back(is.expected_mm());
  }
  const std::vector<Disturbance> left_before = disturbances_of(before, prepared, options.threads),
                                 left_after = disturbances_of(after, prepared, options.threads);
  document["covariate_plots"] = covariate_plots(left_before, left_after);
  document["maps"] = maps(left_before, left_after);
  out.model = proto_of(after);
  say_progress(0.95, "simulation check");
  const proto::Model written_before = proto_of(before);
  const json simulated = simulation_check({before, written_before}, {after, out.model}, other ? *other : prepared,
                                          held_out_only, options.threads);
  for (const auto& [part, content] : simulated.items()) (part == "simulated" ? contract : document)[part] = content;
  document["seconds"]["all"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  out.document = std::move(document);
  say_progress(1, "done");
  return out;
}

}  // namespace kilotwin::identify

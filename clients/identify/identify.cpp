#include "clients/identify/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "clients/identify/fit.hpp"
#include "clients/identify/predict.hpp"
#include "clients/identify/write_model.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

/// Squared distances between predictions and measurements, by (run, robot).
struct Errors {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<double, std::size_t>> by_track;
  double sum = 0, expected = 0;
  std::size_t rows = 0;

  [[nodiscard]] double rmse_mm() const { return rows > 0 ? std::sqrt(sum / static_cast<double>(rows)) : 0; }
  [[nodiscard]] double expected_mm() const {
    return rows > 0 ? std::sqrt(expected / static_cast<double>(rows)) : 0;
  }
};

Errors errors_of(const MeasuredSet& set, const std::vector<Predicted>& predictions) {
  Errors errors;
  for (const Predicted& p : predictions) {
    Sample seen;
    if (!measured_at(set.runs[p.run].tracks[p.place], p.time_s, seen)) continue;
    const double dx = seen.x_mm - p.x_mm, dy = seen.y_mm - p.y_mm, square = dx * dx + dy * dy;
    auto& track = errors.by_track[{p.run, p.place}];
    track.first += square;
    track.second += 1;
    errors.sum += square;
    errors.expected += p.spread_mm * p.spread_mm;
    ++errors.rows;
  }
  return errors;
}

/// Bounds of the rms error with 95 % confidence: by the spread over tracks, which are taken to be independent.
json summary_of(const Errors& errors) {
  double variance = 0;
  const double mean = errors.rows > 0 ? errors.sum / static_cast<double>(errors.rows) : 0;
  for (const auto& [track, part] : errors.by_track) {
    const double excess = part.first - mean * static_cast<double>(part.second);
    variance += excess * excess;
  }
  const double tracks = static_cast<double>(errors.by_track.size());
  if (tracks > 1) variance *= tracks / (tracks - 1);
  const double half = errors.rows > 0 ? 1.96 * std::sqrt(variance) / static_cast<double>(errors.rows) : 0;
  return {{"rmse_mm", errors.rmse_mm()},
          {"rmse_low_mm", std::sqrt(std::max(0.0, mean - half))},
          {"rmse_high_mm", std::sqrt(mean + half)},
          {"rows", errors.rows}};
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
    throw UserError("no robot was measured twice in a run that may be fitted to; there is nothing to identify");
  std::optional<PreparedSet> other;
  if (test != nullptr) other.emplace(*test);
  const PreparedSet& judged = other ? *other : prepared;
  const bool held_out_only = !other && std::any_of(train.runs.begin(), train.runs.end(), [](const Run& run) {
    return std::any_of(run.tracks.begin(), run.tracks.end(), [](const Track& t) { return t.held_out; });
  });

  say_progress(0.02, "base model");
  Fitter fitter(prepared, options.threads);
  MotionModel before;
  fitter.fit(before, 5);

  MotionModel after = before;
  json document;

  say_progress(0.9, "predictions");
  const Asked asked{10, 5, options.horizon_s};
  const std::vector<Predicted> predicted_before = predict(before, judged, asked, held_out_only, options.threads);
  const std::vector<Predicted> predicted_after = predict(after, judged, asked, held_out_only, options.threads);

  Identified out;
  for (std::size_t i = 0; i < predicted_before.size(); ++i) {
    const Predicted &b = predicted_before[i], &a = predicted_after[i];
    KILOTWIN_DEMAND(b.run == a.run && b.place == a.place && b.time_s == a.time_s);
    const Run& run = judged.set().runs[b.run];
    out.predictions.push_back({run.name, run.tracks[b.place].robot, b.time_s, b.x_mm, b.y_mm, a.x_mm, a.y_mm});
  }
  const Errors errors_before = errors_of(judged.set(), predicted_before),
               errors_after = errors_of(judged.set(), predicted_after);
  json& contract = document["contract"];
  contract["before"] = summary_of(errors_before);
  contract["after"] = summary_of(errors_after);
  contract["noise_floor_mm"] = errors_after.expected_mm();
  contract["noise_floor_how"] =
      "what the model with its effects expects of itself: the spread of the filter at the start, the noise of the "
      "motion over "
      "the horizon, and the tracker's noise, all estimated from the innovations one step ahead";
  contract["horizon_s"] = options.horizon_s;
  contract["effects"] = json::array();
  contract["base"] = {
      {"straight_speed_mm_s", after.base.straight_mm_s}, {"turn_speed_mm_s", after.base.turn_mm_s},
      {"wheel_base_mm", after.base.wheel_base_mm},       {"tracked_point_ahead_mm", after.base.ahead_mm},
      {"tracked_point_left_mm", after.base.left_mm},     {"bias_mean_mm_s", after.base.bias_mean_mm_s},
      {"bias_sd_mm_s", after.base.bias_sd_mm_s}};
  contract["noise"] = {{"factor_variance_s", after.noise.factor_s},
                       {"wheel_sd_mm", std::sqrt(after.noise.wheel_mm2_s)},
                       {"heading_sd_rad", std::sqrt(after.noise.heading_rad2_s)},
                       {"drift_sd_mm", std::sqrt(after.noise.drift_mm2_s)},
                       {"tracker_position_sd_mm", std::sqrt(after.noise.position_mm2)},
                       {"tracker_heading_sd_rad", std::sqrt(after.noise.heading_rad2)}};
  out.model = proto_of(after);
  document["seconds"]["all"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  out.document = std::move(document);
  say_progress(1, "done");
  return out;
}

}  // namespace kilotwin::identify

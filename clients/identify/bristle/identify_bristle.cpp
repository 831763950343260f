#include "clients/identify/bristle/identify_bristle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <complex>
#include <map>

#include "clients/identify/bristle/bristle_model.hpp"
#include "clients/identify/bristle/velocity_circle.hpp"
#include "core/base/error.hpp"

namespace kilotwin::bristle {
namespace {

using identify::Identified, identify::Options;
using nlohmann::json;
/// False alarm rate per set.
constexpr double kChance = 0.01;
using Places = std::vector<BristleModel::Place>;

constexpr const char* kNames[] = {"heading-sense", "heading-mount", "front-for-back",
                                  "speed-of-run",  "downhill",      "turning-of-run"};
constexpr const char* kCovariates[][2] = {{"measurement", "heading"}, {"measurement", "robot"},
                                          {"measurement", "history"}, {"robot", "history"},
                                          {"world_frame", "history"}, {"robot", "history"}};
constexpr const char* kActsOn[] = {"MEASURED_HEADING", "MEASURED_HEADING", "MEASURED_HEADING",
                                   "WHEEL_GAIN",       "WORLD_DRIFT",      "TURN_RATE"};

/// Squared errors with sums per run. Runs are independent.
struct Errors {
  std::vector<double> sum, count;

  [[nodiscard]] double mean() const {
    double s = 0, n = 0;
    for (std::size_t r = 0; r < sum.size(); ++r) {
      s += sum[r];
      n += count[r];
    }
    return n > 0 ? s / n : 0;
  }
  /// Standard error over runs of the mean, or of its difference from `other`.
  [[nodiscard]] double error(const Errors* other = nullptr) const {
    double n = 0, spread = 0, runs = 0;
    const double about = other != nullptr ? mean() - other->mean() : mean();
    for (std::size_t r = 0; r < sum.size(); ++r) {
      const double off = sum[r] - (other != nullptr ? other->sum[r] : 0) - about * count[r];
      spread += off * off;
      n += count[r];
      runs += count[r] > 0 ? 1 : 0;
    }
    return runs > 1 ? std::sqrt(spread * runs / (runs - 1)) / n : 0;
  }
};

Errors errors_of(const std::vector<BristleInstant>& instants, const Places& places, std::size_t runs) {
  Errors errors{std::vector<double>(runs, 0), std::vector<double>(runs, 0)};
  for (std::size_t i = 0; i < instants.size(); ++i) {
    const double dx = places[i].x_mm - instants[i].later_x_mm, dy = places[i].y_mm - instants[i].later_y_mm;
    errors.sum[instants[i].run] += dx * dx + dy * dy;
    ++errors.count[instants[i].run];
  }
  return errors;
}

json summary_of(const Errors& errors) {
  const double mean = errors.mean(), half = 1.96 * errors.error();
  double rows = 0;
  for (const double n : errors.count) rows += n;
  return {{"rmse_mm", std::sqrt(mean)},
          {"rmse_low_mm", std::sqrt(std::max(mean - half, 0.0))},
          {"rmse_high_mm", std::sqrt(mean + half)},
          {"rows", static_cast<std::int64_t>(rows)}};
}

/// Four-fold cross-validation over the training runs.
class Folds {
 public:
  Folds(const std::vector<BristleInstant>& learned, double horizon_s) : horizon_s_(horizon_s) {
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      std::vector<BristleInstant> rest, own;
      for (const BristleInstant& i : learned) (i.run % kFolds == fold ? own : rest).push_back(i);
      if (rest.empty() || own.empty()) continue;
      models_.emplace_back(rest);
      left_out_.push_back(std::move(own));
    }
  }
  /// Sum of squared errors.
  [[nodiscard]] double error(const BristleEffects& on) const {
    double sum = 0;
    for (std::size_t fold = 0; fold < models_.size(); ++fold) {
      const Places places = models_[fold].predict(left_out_[fold], horizon_s_, on);
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double dx = places[i].x_mm - left_out_[fold][i].later_x_mm,
                     dy = places[i].y_mm - left_out_[fold][i].later_y_mm;
        sum += dx * dx + dy * dy;
      }
    }
    return sum;
  }

 private:
  static constexpr std::size_t kFolds = 4;
  double horizon_s_;
  std::vector<BristleModel> models_;
  std::vector<std::vector<BristleInstant>> left_out_;
};

/// Reference without any model: extrapolation of the last half second.
double extrapolation_rmse_mm(const std::vector<BristleInstant>& instants, double horizon_s) {
  double sum = 0;
  for (const BristleInstant& i : instants) {
    const double dx = i.x_mm + i.vx_mm_s * horizon_s - i.later_x_mm,
                 dy = i.y_mm + i.vy_mm_s * horizon_s - i.later_y_mm;
    sum += dx * dx + dy * dy;
  }
  return instants.empty() ? 0 : std::sqrt(sum / static_cast<double>(instants.size()));
}

std::string words_of(BristleEffect effect, const BristleModel& m) {
  switch (effect) {
    case BristleEffect::kSense:
      return fmt::format(
          "the tracker's headings run clockwise with an offset of {:.2f} rad: alignment with the motion {:.2f}, as "
          "measured {:.2f}",
          m.sense_rad, m.aligned_turned, m.aligned);
    case BristleEffect::kMount: return "the heading offset differs between robots";
    case BristleEffect::kAxis:
      return fmt::format(
          "the tracker sometimes confuses front and back: alignment with the motion {:.2f} for the axis, {:.2f} "
          "for the "
          "heading",
          m.aligned_axis, m.aligned_turned);
    case BristleEffect::kSpeed:
      return fmt::format("the speed differs between runs; median {:.0f} mm/s", m.speed_mm_s);
    case BristleEffect::kDrift: {
      const double size = std::hypot(m.drift_x, m.drift_y),
                   direction = std::atan2(m.drift_y, m.drift_x) * 180 / 3.14159265358979;
      return fmt::format(
          "robots drift towards {:.0f} degrees by {:.2f} +- {:.2f} of their speed (median of {} runs, standard "
          "deviation "
          "between runs {:.2f})",
          direction, size, 1.96 * m.drift_se, m.drift_runs, m.drift_sd);
    }
    case BristleEffect::kTurn: return "the turn rate differs between runs";
  }
  return {};
}

json parameters_of(BristleEffect effect, const BristleModel& m) {
  switch (effect) {
    case BristleEffect::kSense:
      return {{"form", "linear in the heading"}, {"slope", -2}, {"at_zero_rad", m.sense_rad}};
    case BristleEffect::kAxis: return {{"form", "occasional offset of pi"}};
    case BristleEffect::kDrift:
      return {{"form", "constant times the speed"},
              {"x", m.drift_x},
              {"y", m.drift_y},
              {"se", m.drift_se},
              {"sd_between_runs", m.drift_sd}};
    case BristleEffect::kSpeed: return {{"form", "table by run"}, {"median_mm_s", m.speed_mm_s}};
    default: return {{"form", "table by run"}};
  }
}

/// Mean speed by direction of motion, minus the run's own: a drift makes one direction faster.
json speed_by_direction(const std::vector<BristleInstant>& instants, const BristleModel& m, bool drifting) {
  constexpr std::size_t kSectors = 8;
  constexpr double kPi = 3.14159265358979;
  std::map<std::size_t, std::vector<std::complex<double>>> ways;
  for (const BristleInstant& i : instants) ways[i.run].emplace_back(i.vx_mm_s, i.vy_mm_s);
  std::array<double, kSectors> before{}, squares{}, after{}, count{};
  for (const auto& [run, of_run] : ways) {
    const VelocityCircle circle = fit_circle(of_run, {m.drift_x, m.drift_y}, 6);
    for (const std::complex<double>& way : of_run) {
      const double part = (std::arg(way) + kPi) / (2 * kPi) * kSectors;
      const std::size_t s = std::min(static_cast<std::size_t>(part), kSectors - 1);
      const double faster = std::abs(way) - circle.speed_mm_s;
      const std::complex<double> own = drifting ? way - circle.drift * circle.speed_mm_s : way;
      before[s] += faster;
      squares[s] += faster * faster;
      after[s] += std::abs(own) - circle.speed_mm_s;
      ++count[s];
    }
  }
  json plot = {{"target", "forward"},
               {"covariate", "direction of motion"},
               {"unit", "rad"},
               {"acts_on_unit", "mm/s"},
               {"fitted", nullptr}};
  for (const char* list : {"at", "before", "before_se", "after"}) plot[list] = json::array();
  for (std::size_t s = 0; s < kSectors; ++s) {
    if (count[s] < 5) continue;
    const double mean = before[s] / count[s];
    plot["at"].push_back((static_cast<double>(s) + 0.5) * 2 * kPi / kSectors - kPi);
    plot["before"].push_back(mean);
    plot["before_se"].push_back(std::sqrt(std::max(squares[s] / count[s] - mean * mean, 0.0) / count[s]));
    plot["after"].push_back(after[s] / count[s]);
  }
  return plot;
}

json table_of_runs(const json& runs) {
  json rows = json::array();
  for (const json& run : runs) {
    const double x = run.at("drift_x_mm_s"), y = run.at("drift_y_mm_s"), speed = run.at("speed_mm_s");
    rows.push_back({run.at("run"), run.at("held_out").get<bool>() ? "held out" : "training",
                    fmt::format("{:.0f}", speed), fmt::format("{:+.2f}", speed > 0 ? x / speed : 0),
                    fmt::format("{:+.2f}", speed > 0 ? y / speed : 0),
                    fmt::format("{:+.2f}", run.at("turn_rad_s").get<double>())});
  }
  return {{"id", "runs"},
          {"title", "Runs"},
          {"lead",
           "Velocities of a run lie on a circle: its radius is the robot's speed, its centre the drift, given "
           "relative to "
           "that speed along x and y. Runs with a single direction use the median drift of the others."},
          {"head", {"run", "", "speed, mm/s", "drift along x", "along y", "turn rate, rad/s"}},
          {"rows", rows}};
}

/// The model file: the median robot on this table.
proto::Model proto_of(const BristleModel& m, const BristleEffects& on) {
  const auto has = [&](BristleEffect effect) { return on[static_cast<std::size_t>(effect)]; };
  proto::Model model;
  model.mutable_motion()->set_straight_speed_mm_s(m.speed_mm_s);
  model.mutable_motion()->set_bias_mean_mm_s(0);
  model.mutable_motion()->set_bias_sd_mm_s(0);
  model.mutable_motion()->set_effects_limit_mm_s(std::max(50.0, 2 * m.speed_mm_s));
  if (has(BristleEffect::kSense)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name(kNames[0]);
    effect.set_acts_on(proto::Effect::MEASURED_HEADING);
    proto::Function& function = *effect.add_function();
    function.set_of(proto::Function::HEADING);
    function.mutable_linear()->set_slope(-2);
    function.mutable_linear()->set_at_zero(m.sense_rad);
  }
  if (has(BristleEffect::kDrift)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name("downhill");
    effect.set_acts_on(proto::Effect::WORLD_DRIFT);
    effect.set_direction_deg(std::atan2(m.drift_y, m.drift_x) * 180 / 3.14159265358979);
    effect.add_function()->set_constant(std::hypot(m.drift_x, m.drift_y) * m.speed_mm_s);
  }
  return model;
}

}  // namespace

Identified identify_bristle(std::vector<BristleRun> train, std::vector<BristleRun> test, const Options& options) {
  const auto started = std::chrono::steady_clock::now();
  if (test.empty()) {
    if (train.size() < 2) throw UserError("one run cannot be held out; give at least two runs, or --test DIR");
    std::vector<BristleRun> kept;
    // One run in four, and with fewer the last one.
    const std::size_t first = std::min<std::size_t>(3, train.size() - 1);
    for (std::size_t r = 0; r < train.size(); ++r) (r % 4 == first ? test : kept).push_back(std::move(train[r]));
    train = std::move(kept);
  }
  const double h = options.horizon_s;
  const std::vector<BristleInstant> learned = instants_of(train, h), judged = instants_of(test, h);
  if (learned.empty() || judged.empty())
    throw UserError(fmt::format("no run has {:g} s without a gap; give a shorter --horizon", h + 3));
  const BristleModel model(learned);
  const auto errors_on = [&](const std::vector<BristleInstant>& instants, std::size_t runs,
                             const BristleEffects& on) {
    return errors_of(instants, model.predict(instants, h, on), runs);
  };

  // Forward selection: adds the effect with the largest reduction of the cross-validated error, as long as it
  // exceeds three standard errors over runs. Then less than 1 in 100 sets has a false alarm, over six tests.
  BristleEffects on{};
  json effects = json::array(), rejected = json::array(), steps = json::array();
  std::vector<BristleEffect> order;
  Errors now = errors_on(learned, train.size(), on), now_out = errors_on(judged, test.size(), on);
  const Errors before_out = now_out;
  steps.push_back({{"added", "base"}, {"rmse_mm", std::sqrt(now_out.mean())}});
  for (bool searching = options.find_effects; searching;) {
    searching = false;
    std::size_t best = kBristleEffects;
    Errors best_errors;
    for (std::size_t e = 0; e < kBristleEffects; ++e) {
      // Mount offset and axis are only defined once the sense of rotation is known.
      const bool waits = !on[0] && (e == static_cast<std::size_t>(BristleEffect::kMount) ||
                                    e == static_cast<std::size_t>(BristleEffect::kAxis) ||
                                    e == static_cast<std::size_t>(BristleEffect::kDrift));
      if (on[e] || waits) continue;
      BristleEffects with = on;
      with[e] = true;
      const Errors errors = errors_on(learned, train.size(), with);
      // The test of drift uses velocities, whether or not it improves predictions.
      const bool drifting = e == static_cast<std::size_t>(BristleEffect::kDrift) &&
                            model.drift_p < kChance / kBristleEffects && errors.mean() < now.mean();
      if (!drifting && now.mean() - errors.mean() < 3 * now.error(&errors)) continue;
      if (best == kBristleEffects || errors.mean() < best_errors.mean()) {
        best = e;
        best_errors = errors;
      }
    }
    if (best == kBristleEffects) break;
    BristleEffects with = on;
    with[best] = true;
    const Errors out = errors_on(judged, test.size(), with);
    const double gain = now_out.mean() - out.mean();
    steps.push_back({{"added", kNames[best]}, {"rmse_mm", std::sqrt(out.mean())}, {"held_out_gain", gain}});
    on = with;
    now = best_errors;
    now_out = out;
    order.push_back(static_cast<BristleEffect>(best));
    searching = true;
    if (options.progress) options.progress(0.2 + 0.1 * static_cast<double>(order.size()), kNames[best]);
  }
  // Evaluates each effect by cross-validation.
  const Folds folds(learned, h);
  for (std::size_t i = order.size(); i-- > 0;) {
    const auto e = static_cast<std::size_t>(order[i]);
    BristleEffects without = on;
    without[e] = false;
    if (folds.error(without) > folds.error(on)) continue;
    rejected.push_back({{"name", kNames[e]},
                        {"covariates", kCovariates[e]},
                        {"acts_on", kActsOn[e]},
                        {"why", "no cross-validated gain on the training runs"}});
    on = without;
    now_out = errors_on(judged, test.size(), on);
    order.erase(order.begin() + static_cast<std::ptrdiff_t>(i));
  }
  // The effects together must predict better than none.
  if (!order.empty() && !(folds.error(on) < folds.error(BristleEffects{}))) {
    for (const BristleEffect effect : order)
      rejected.push_back({{"name", kNames[static_cast<std::size_t>(effect)]},
                          {"covariates", kCovariates[static_cast<std::size_t>(effect)]},
                          {"acts_on", kActsOn[static_cast<std::size_t>(effect)]},
                          {"why", "no cross-validated gain of all effects together on the training runs"}});
    on = {};
    now_out = before_out;
    order.clear();
  }
  const double total = before_out.mean() - now_out.mean();
  for (const BristleEffect effect : order) {
    const auto e = static_cast<std::size_t>(effect);
    BristleEffects without = on;
    without[e] = false;
    const Errors less = errors_on(judged, test.size(), without),
                 less_in = errors_on(learned, train.size(), without);
    const double gain_in = less_in.mean() - errors_on(learned, train.size(), on).mean();
    const Errors with_in = errors_on(learned, train.size(), on);
    json evidence = {{"standard_errors", gain_in / std::max(less_in.error(&with_in), 1e-12)},
                     {"held_out_gain", less.mean() - now_out.mean()},
                     {"held_out_gain_se", less.error(&now_out)}};
    if (effect == BristleEffect::kDrift) evidence["log10_p"] = std::log10(std::max(model.drift_p, 1e-300));
    effects.push_back({{"name", kNames[e]},
                       {"covariates", kCovariates[e]},
                       {"acts_on", kActsOn[e]},
                       {"evidence", evidence},
                       {"parameters", parameters_of(effect, model)},
                       {"rmse_without_mm", std::sqrt(less.mean())},
                       {"share_removed", total > 0 ? (less.mean() - now_out.mean()) / total : 0},
                       {"in_words", words_of(effect, model)}});
  }
  for (std::size_t e = 0; e < kBristleEffects; ++e) {
    const bool refused = !on[e] && std::none_of(rejected.begin(), rejected.end(),
                                                [&](const json& r) { return r["name"] == kNames[e]; });
    if (refused)
      rejected.push_back({{"name", kNames[e]},
                          {"covariates", kCovariates[e]},
                          {"acts_on", kActsOn[e]},
                          {"why", "not significant"}});
  }

  Identified out;
  out.model = proto_of(model, on);
  const Places before = model.predict(judged, h, BristleEffects{}), after = model.predict(judged, h, on);
  for (std::size_t i = 0; i < judged.size(); ++i) {
    const BristleRun& run = test[judged[i].run];
    out.predictions.push_back(
        {run.name, run.robot, judged[i].time_s, before[i].x_mm, before[i].y_mm, after[i].x_mm, after[i].y_mm});
  }
  json faults = json::array();
  for (const auto* set : {&train, &test}) {
    for (const BristleRun& run : *set) {
      if (run.dropped * 50 > run.size())
        faults.push_back(
            {{"kind", "jumps"},
             {"run", run.name},
             {"robot", run.robot},
             {"in_words", fmt::format("{} of {} rows have positions that the robot cannot have reached",
                                      run.dropped, run.dropped + run.size())}});
    }
  }
  json runs = json::array();
  for (const auto* set : {&train, &test}) {
    for (const BristleSummary& s : summaries_of(model, *set, set == &train ? learned : judged)) {
      runs.push_back({{"run", s.run},
                      {"speed_mm_s", s.speed_mm_s},
                      {"drift_x_mm_s", s.drift_x_mm_s},
                      {"drift_y_mm_s", s.drift_y_mm_s},
                      {"turn_rad_s", s.turn_rad_s},
                      {"mount_rad", s.mount_rad},
                      {"held_out", set == &test}});
    }
  }
  json& document = out.document;
  document["contract"] = {
      {"before", summary_of(before_out)},
      {"after", summary_of(now_out)},
      {"noise_floor_mm", extrapolation_rmse_mm(judged, h)},
      {"noise_floor_how",
       "the error of an extrapolation of the last half second, which needs no model; a model may be better"},
      {"horizon_s", h},
      {"effects", effects},
      {"base", {{"straight_speed_mm_s", model.speed_mm_s}}},
      {"runs", runs},
      {"rejected", rejected},
      {"ambiguous",
       json::array({{{"found", "downhill"},
                     {"instead", "a vibration of the table that moves robots"},
                     {"experiment", "rotate the table by 180 degrees, or record with the motors off"}}})},
      {"faults", faults}};
  if (!on[static_cast<std::size_t>(BristleEffect::kDrift)]) document["contract"]["ambiguous"] = json::array();
  // Errors over the horizon for the same runs, with the parameters fitted at one horizon.
  json& horizon = document["horizon"];
  for (const char* list : {"at_s", "before_mm", "after_mm", "floor_mm"}) horizon[list] = json::array();
  for (const double ahead_s : {0.25, 0.5, 1.0, 2.0, 3.0, 5.0}) {
    const std::vector<BristleInstant> instants = instants_of(test, ahead_s);
    if (instants.empty()) continue;
    const auto rmse = [&](const BristleEffects& with) {
      return std::sqrt(errors_of(instants, model.predict(instants, ahead_s, with), test.size()).mean());
    };
    horizon["at_s"].push_back(ahead_s);
    horizon["before_mm"].push_back(rmse(BristleEffects{}));
    horizon["after_mm"].push_back(rmse(on));
    horizon["floor_mm"].push_back(extrapolation_rmse_mm(instants, ahead_s));
  }
  document["covariate_plots"] = {
      speed_by_direction(judged, model, on[static_cast<std::size_t>(BristleEffect::kDrift)])};
  document["tables"] = {table_of_runs(runs)};
  document["set"] = {{"runs", train.size() + test.size()}, {"has_headings", true}, {"has_commands", false}};
  document["steps"] = steps;
  document["seconds"]["all"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (options.progress) options.progress(1, "done");
  return out;
}

}  // namespace kilotwin::bristle

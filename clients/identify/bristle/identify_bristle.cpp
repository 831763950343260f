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
/// Of a set without an effect to show one.
constexpr double kChance = 0.01;
using Places = std::vector<RideModel::Place>;

constexpr const char* kNames[] = {"heading-sense", "heading-mount", "front-for-back",
                                  "speed-of-run",  "downhill",      "turning-of-run"};
constexpr const char* kCovariates[][2] = {{"measurement", "heading"}, {"measurement", "robot"},
                                          {"measurement", "history"}, {"robot", "history"},
                                          {"world_frame", "history"}, {"robot", "history"}};
constexpr const char* kActsOn[] = {"MEASURED_HEADING", "MEASURED_HEADING", "MEASURED_HEADING",
                                   "WHEEL_GAIN",       "WORLD_DRIFT",      "TURN_RATE"};

/// Squared errors, with their sums by run: runs are what is independent.
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
  /// Standard error of the mean, by the spread of runs; of this, or of what it is more than `other`.
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

Errors errors_of(const std::vector<RideInstant>& instants, const Places& places, std::size_t runs) {
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

/// Training runs in four parts: each is predicted by what the other three teach.
class Folds {
 public:
  Folds(const std::vector<RideInstant>& learned, double horizon_s) : horizon_s_(horizon_s) {
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      std::vector<RideInstant> rest, own;
      for (const RideInstant& i : learned) (i.run % kFolds == fold ? own : rest).push_back(i);
      if (rest.empty() || own.empty()) continue;
      models_.emplace_back(rest);
      left_out_.push_back(std::move(own));
    }
  }
  /// Sum of squared errors.
  [[nodiscard]] double error(const RideEffects& on) const {
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
  std::vector<RideModel> models_;
  std::vector<std::vector<RideInstant>> left_out_;
};

/// What remains when the way of the last half second goes on: no knowledge of the robot, but the best short memory.
double going_on_mm(const std::vector<RideInstant>& instants, double horizon_s) {
  double sum = 0;
  for (const RideInstant& i : instants) {
    const double dx = i.x_mm + i.vx_mm_s * horizon_s - i.later_x_mm,
                 dy = i.y_mm + i.vy_mm_s * horizon_s - i.later_y_mm;
    sum += dx * dx + dy * dy;
  }
  return instants.empty() ? 0 : std::sqrt(sum / static_cast<double>(instants.size()));
}

std::string words_of(RideEffect effect, const RideModel& m) {
  switch (effect) {
    case RideEffect::kSense:
      return fmt::format(
          "the tracker counts headings clockwise, from an axis {:.2f} rad off: the way goes with it at {:.2f} of "
          "1, "
          "with the heading as measured at {:.2f}",
          m.sense_rad, m.aligned_turned, m.aligned);
    case RideEffect::kMount: return "the axis differs from robot to robot";
    case RideEffect::kAxis:
      return fmt::format(
          "the tracker takes the front for the back at times: the axis goes with the way at {:.2f} of 1, the "
          "heading "
          "at {:.2f}",
          m.aligned_axis, m.aligned_turned);
    case RideEffect::kSpeed:
      return fmt::format("each run has its own speed; {:.0f} mm/s in the middle", m.speed_mm_s);
    case RideEffect::kDrift: {
      const double size = std::hypot(m.drift_x, m.drift_y),
                   direction = std::atan2(m.drift_y, m.drift_x) * 180 / 3.14159265358979;
      return fmt::format(
          "the table carries robots towards {:.0f} degrees by {:.2f} +- {:.2f} of their own speed in the median of "
          "{} "
          "runs, which differ by {:.2f}: velocities lie on circles off zero",
          direction, size, 1.96 * m.drift_se, m.drift_runs, m.drift_sd);
    }
    case RideEffect::kTurn: return "each run turns at a rate of its own";
  }
  return {};
}

json parameters_of(RideEffect effect, const RideModel& m) {
  switch (effect) {
    case RideEffect::kSense:
      return {{"form", "linear in the heading"}, {"slope", -2}, {"at_zero_rad", m.sense_rad}};
    case RideEffect::kAxis: return {{"form", "half a turn at times"}};
    case RideEffect::kDrift:
      return {{"form", "constant times the speed"},
              {"x", m.drift_x},
              {"y", m.drift_y},
              {"se", m.drift_se},
              {"sd_between_runs", m.drift_sd}};
    case RideEffect::kSpeed: return {{"form", "table by run"}, {"median_mm_s", m.speed_mm_s}};
    default: return {{"form", "table by run"}};
  }
}

/// Speeds over the direction of the way, less the run's own: what carries robots makes them faster one way.
json speed_by_direction(const std::vector<RideInstant>& instants, const RideModel& m, bool carried) {
  constexpr std::size_t kSectors = 8;
  constexpr double kPi = 3.14159265358979;
  std::map<std::size_t, std::vector<std::complex<double>>> ways;
  for (const RideInstant& i : instants) ways[i.run].emplace_back(i.vx_mm_s, i.vy_mm_s);
  std::array<double, kSectors> before{}, squares{}, after{}, count{};
  for (const auto& [run, of_run] : ways) {
    const VelocityCircle circle = circle_through(of_run, {m.drift_x, m.drift_y}, 6);
    for (const std::complex<double>& way : of_run) {
      const double part = (std::arg(way) + kPi) / (2 * kPi) * kSectors;
      const std::size_t s = std::min(static_cast<std::size_t>(part), kSectors - 1);
      const double faster = std::abs(way) - circle.speed_mm_s;
      const std::complex<double> own = carried ? way - circle.drift * circle.speed_mm_s : way;
      before[s] += faster;
      squares[s] += faster * faster;
      after[s] += std::abs(own) - circle.speed_mm_s;
      ++count[s];
    }
  }
  json plot = {{"target", "forward"},
               {"covariate", "direction of the way"},
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
    rows.push_back({run.at("run"), run.at("held_out").get<bool>() ? "held out" : "learned from",
                    fmt::format("{:.0f}", speed), fmt::format("{:+.2f}", speed > 0 ? x / speed : 0),
                    fmt::format("{:+.2f}", speed > 0 ? y / speed : 0),
                    fmt::format("{:+.2f}", run.at("turn_rad_s").get<double>())});
  }
  return {
      {"id", "runs"},
      {"title", "Run by run"},
      {"lead",
       "A robot's own speed is the radius of the circle on which its velocities lie; the circle's centre is what "
       "carries it, in parts of that speed along x and y. Runs that went one way only have the median of the "
       "others."},
      {"head", {"run", "", "speed, mm/s", "carried along x", "along y", "turns, rad/s"}},
      {"rows", rows}};
}

/// What the model file can say: the median robot on this table.
proto::Model proto_of(const RideModel& m, const RideEffects& on) {
  const auto has = [&](RideEffect effect) { return on[static_cast<std::size_t>(effect)]; };
  proto::Model model;
  model.mutable_motion()->set_straight_speed_mm_s(m.speed_mm_s);
  model.mutable_motion()->set_bias_mean_mm_s(0);
  model.mutable_motion()->set_bias_sd_mm_s(0);
  model.mutable_motion()->set_effects_limit_mm_s(std::max(50.0, 2 * m.speed_mm_s));
  if (has(RideEffect::kSense)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name(kNames[0]);
    effect.set_acts_on(proto::Effect::MEASURED_HEADING);
    proto::Function& function = *effect.add_function();
    function.set_of(proto::Function::HEADING);
    function.mutable_linear()->set_slope(-2);
    function.mutable_linear()->set_at_zero(m.sense_rad);
  }
  if (has(RideEffect::kDrift)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name("downhill");
    effect.set_acts_on(proto::Effect::WORLD_DRIFT);
    effect.set_direction_deg(std::atan2(m.drift_y, m.drift_x) * 180 / 3.14159265358979);
    effect.add_function()->set_constant(std::hypot(m.drift_x, m.drift_y) * m.speed_mm_s);
  }
  return model;
}

}  // namespace

Identified identify_ridden(std::vector<RiddenRun> train, std::vector<RiddenRun> test, const Options& options) {
  const auto started = std::chrono::steady_clock::now();
  if (test.empty()) {
    std::vector<RiddenRun> kept;
    for (std::size_t r = 0; r < train.size(); ++r) (r % 4 == 3 ? test : kept).push_back(std::move(train[r]));
    train = std::move(kept);
  }
  const double h = options.horizon_s;
  const std::vector<RideInstant> learned = instants_of(train, h), judged = instants_of(test, h);
  if (learned.empty() || judged.empty())
    throw UserError(fmt::format("no run goes on for {:g} s without a gap; give a shorter --horizon", h + 3));
  const RideModel model(learned);
  const auto errors_on = [&](const std::vector<RideInstant>& instants, std::size_t runs, const RideEffects& on) {
    return errors_of(instants, model.predict(instants, h, on), runs);
  };

  // One effect after the other, each the one that lowers the error on the training runs most, as long as that is beyond chance:
  // three standard errors over runs, which is less than 1 in 100 for six tries.
  RideEffects on{};
  json effects = json::array(), rejected = json::array(), steps = json::array();
  std::vector<RideEffect> order;
  Errors now = errors_on(learned, train.size(), on), now_out = errors_on(judged, test.size(), on);
  const Errors before_out = now_out;
  steps.push_back({{"added", "base"}, {"rmse_mm", std::sqrt(now_out.mean())}});
  for (bool searching = options.trace; searching;) {
    searching = false;
    std::size_t best = kRideEffects;
    Errors best_errors;
    for (std::size_t e = 0; e < kRideEffects; ++e) {
      // The mount and the axis say something about the heading only once its sense is known.
      const bool waits = !on[0] && (e == static_cast<std::size_t>(RideEffect::kMount) ||
                                    e == static_cast<std::size_t>(RideEffect::kAxis) ||
                                    e == static_cast<std::size_t>(RideEffect::kDrift));
      if (on[e] || waits) continue;
      RideEffects with = on;
      with[e] = true;
      const Errors errors = errors_on(learned, train.size(), with);
      // What carries robots shows in their velocities, whether or not it helps to predict them.
      const bool carried = e == static_cast<std::size_t>(RideEffect::kDrift) &&
                           model.drift_p < kChance / kRideEffects && errors.mean() < now.mean();
      if (!carried && now.mean() - errors.mean() < 3 * now.error(&errors)) continue;
      if (best == kRideEffects || errors.mean() < best_errors.mean()) {
        best = e;
        best_errors = errors;
      }
    }
    if (best == kRideEffects) break;
    RideEffects with = on;
    with[best] = true;
    const Errors out = errors_on(judged, test.size(), with);
    const double gain = now_out.mean() - out.mean();
    steps.push_back({{"added", kNames[best]}, {"rmse_mm", std::sqrt(out.mean())}, {"held_out_gain", gain}});
    on = with;
    now = best_errors;
    now_out = out;
    order.push_back(static_cast<RideEffect>(best));
    searching = true;
    if (options.progress) options.progress(0.2 + 0.1 * static_cast<double>(order.size()), kNames[best]);
  }
  // Each must earn its place on training runs that were left out when the others were learned from.
  const Folds folds(learned, h);
  for (std::size_t i = order.size(); i-- > 0;) {
    const auto e = static_cast<std::size_t>(order[i]);
    RideEffects without = on;
    without[e] = false;
    if (folds.error(without) > folds.error(on)) continue;
    rejected.push_back({{"name", kNames[e]},
                        {"covariates", kCovariates[e]},
                        {"acts_on", kActsOn[e]},
                        {"why", "no gain on training runs that were left out in turn"}});
    on = without;
    now_out = errors_on(judged, test.size(), on);
    order.erase(order.begin() + static_cast<std::ptrdiff_t>(i));
  }
  const double total = before_out.mean() - now_out.mean();
  for (const RideEffect effect : order) {
    const auto e = static_cast<std::size_t>(effect);
    RideEffects without = on;
    without[e] = false;
    const Errors less = errors_on(judged, test.size(), without),
                 less_in = errors_on(learned, train.size(), without);
    const double gain_in = less_in.mean() - errors_on(learned, train.size(), on).mean();
    const Errors with_in = errors_on(learned, train.size(), on);
    json evidence = {{"standard_errors", gain_in / std::max(less_in.error(&with_in), 1e-12)},
                     {"held_out_gain", less.mean() - now_out.mean()},
                     {"held_out_gain_se", less.error(&now_out)}};
    if (effect == RideEffect::kDrift) evidence["log10_p"] = std::log10(std::max(model.drift_p, 1e-300));
    effects.push_back({{"name", kNames[e]},
                       {"covariates", kCovariates[e]},
                       {"acts_on", kActsOn[e]},
                       {"evidence", evidence},
                       {"parameters", parameters_of(effect, model)},
                       {"rmse_without_mm", std::sqrt(less.mean())},
                       {"share_removed", total > 0 ? (less.mean() - now_out.mean()) / total : 0},
                       {"in_words", words_of(effect, model)}});
  }
  for (std::size_t e = 0; e < kRideEffects; ++e) {
    const bool refused = !on[e] && std::none_of(rejected.begin(), rejected.end(),
                                                [&](const json& r) { return r["name"] == kNames[e]; });
    if (refused)
      rejected.push_back(
          {{"name", kNames[e]}, {"covariates", kCovariates[e]}, {"acts_on", kActsOn[e]}, {"why", "within chance"}});
  }

  Identified out;
  out.model = proto_of(model, on);
  const Places before = model.predict(judged, h, RideEffects{}), after = model.predict(judged, h, on);
  for (std::size_t i = 0; i < judged.size(); ++i) {
    const RiddenRun& run = test[judged[i].run];
    out.predictions.push_back(
        {run.name, run.robot, judged[i].time_s, before[i].x_mm, before[i].y_mm, after[i].x_mm, after[i].y_mm});
  }
  json faults = json::array();
  for (const auto* set : {&train, &test}) {
    for (const RiddenRun& run : *set) {
      if (run.dropped * 50 > run.size())
        faults.push_back({{"kind", "jumps"},
                          {"run", run.name},
                          {"robot", run.robot},
                          {"in_words", fmt::format("{} of {} rows lie where the robot cannot have been",
                                                   run.dropped, run.dropped + run.size())}});
    }
  }
  json runs = json::array();
  for (const auto* set : {&train, &test}) {
    for (const RideSummary& s : summaries_of(model, *set, set == &train ? learned : judged)) {
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
      {"noise_floor_mm", std::min(going_on_mm(judged, h), std::sqrt(now_out.mean()))},
      {"noise_floor_how",
       "what remains where the way of the last half second goes on, or the model if that is better"},
      {"horizon_s", h},
      {"effects", effects},
      {"base", {{"straight_speed_mm_s", model.speed_mm_s}}},
      {"runs", runs},
      {"rejected", rejected},
      {"ambiguous",
       json::array({{{"found", "downhill"},
                     {"instead", "a vibration of the table that carries robots"},
                     {"experiment", "turn the table by half a turn, or ride with the motors at rest"}}})},
      {"faults", faults}};
  if (!on[static_cast<std::size_t>(RideEffect::kDrift)]) document["contract"]["ambiguous"] = json::array();
  // How errors grow with how far ahead: for the same runs, with what was learned for one horizon.
  json& horizon = document["horizon"];
  for (const char* list : {"at_s", "before_mm", "after_mm", "floor_mm"}) horizon[list] = json::array();
  for (const double ahead_s : {0.25, 0.5, 1.0, 2.0, 3.0, 5.0}) {
    const std::vector<RideInstant> instants = instants_of(test, ahead_s);
    if (instants.empty()) continue;
    const auto rmse = [&](const RideEffects& with) {
      return std::sqrt(errors_of(instants, model.predict(instants, ahead_s, with), test.size()).mean());
    };
    const double with = rmse(on);
    horizon["at_s"].push_back(ahead_s);
    horizon["before_mm"].push_back(rmse(RideEffects{}));
    horizon["after_mm"].push_back(with);
    horizon["floor_mm"].push_back(std::min(going_on_mm(instants, ahead_s), with));
  }
  document["covariate_plots"] = {
      speed_by_direction(judged, model, on[static_cast<std::size_t>(RideEffect::kDrift)])};
  document["tables"] = {table_of_runs(runs)};
  document["set"] = {{"runs", train.size() + test.size()}, {"has_headings", true}, {"has_commands", false}};
  document["steps"] = steps;
  document["seconds"]["all"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  if (options.progress) options.progress(1, "done");
  return out;
}

}  // namespace kilotwin::bristle

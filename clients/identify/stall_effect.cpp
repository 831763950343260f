#include "clients/identify/stall_effect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "clients/identify/fit/spell_scan.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/result/values.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

constexpr std::size_t kFewestSpells = 5;  // spells; with fewer, stalls count as no gain
/// As of effects on the noise.
constexpr double kLeastStallGain = 10, kLeastStallErrors = 3;
constexpr std::size_t kRobotFolds = 6;
/// Heavy tails of the noise make robots faster as often as slower. Spells of a higher speed must gain less than this share.
constexpr double kMostMirrored = 0.5;
/// Random spells of different robots are independent, which gives a dispersion of 1. Robots that are slow together show an effect that the
/// model lacks.
constexpr double kMostDispersion = 2;
/// A true spell may hold a robot where others come near, for as long as it lasts.
constexpr double kMostAtObstacles = 2;
/// Mean time apart; scale, tail and shape of durations; and the speed within, if it is not zero.
constexpr std::uint32_t kDegrees = 4;

/// Stalls with parameters fitted at this speed within spells, and their gain. Without enough spells: no gain.
std::pair<Stalls, double> first_fit(const SpellScan& scan, const MotionModel& model, double speed) {
  Stalls stalls;
  stalls.gain = speed;
  SpellScan::Found found = scan.scan(model, stalls);
  if (found.spells < kFewestSpells) return {stalls, 0};
  stalls = scan.refined(found, stalls);
  found = scan.scan(model, stalls);
  return {scan.refined(found, stalls), found.spells < kFewestSpells ? 0 : found.gain};
}

/// The most likely speed within spells. 0 if the data do not exclude it.
double fitted_speed(const SpellScan& scan, const MotionModel& model, Stalls stalls) {
  // First and last step of the speed, its bound, and nat by which it must exceed standstill. A higher bound takes slow
  // motion for spells; a smaller last number states speeds that are chance.
  constexpr double kFirst = 0.2, kLast = 0.05, kMost = 0.9, kClear = 3;
  const auto value = [&](double speed) {
    stalls.gain = speed;
    return scan.scan(model, stalls).gain;
  };
  constexpr int kMostMoves = 30;  // bound on the moves, each at the cost of up to two scans
  double best = stalls.gain, gain = value(best);
  int moves = 0;
  for (double step = kFirst; step >= kLast && moves < kMostMoves; ++moves) {
    bool moved = false;
    for (const double to : {best - step, best + step}) {
      if (to < 0 || to > kMost) continue;
      const double found = value(to);
      // Negated, so that a likelihood that is no number is no gain.
      if (!(found > gain)) continue;
      gain = found;
      best = to;
      moved = true;
      break;
    }
    if (!moved) step /= 2;
  }
  return best > 0 && value(0) > gain - kClear ? 0 : best;
}

/// The speed within spells by a step of Newton's method, and half of its 95 % interval. The latter follows from the spread of the tracks'
/// slopes (the sandwich estimator), since tracks differ by more than their noise.
std::pair<double, double> speed_and_half(const SpellScan& scan, const MotionModel& model, Stalls stalls) {
  // Step of the difference quotients and of the result, and least curvature. Where gains are flat, a smaller curvature
  // would make a longer step and a wider interval.
  constexpr double kStep = 0.05, kLeastCurvature = 1;
  const double speed = stalls.gain;
  const auto gains = [&](double at) {
    stalls.gain = at;
    return scan.scan(model, stalls).gains;
  };
  const std::vector<double> below = gains(speed - kStep), here = gains(speed), above = gains(speed + kStep);
  double slope = 0, squares = 0, curvature = 0;
  for (std::size_t v = 0; v < here.size(); ++v) {
    const double own = (above[v] - below[v]) / (2 * kStep);
    slope += own;
    squares += own * own;
    curvature += (2 * here[v] - below[v] - above[v]) / (kStep * kStep);
  }
  curvature = std::max(curvature, kLeastCurvature);
  constexpr double kLeast = 0.01;  // at 0 robots would stand still
  return {std::max(kLeast, speed + std::clamp(slope / curvature, -kStep, kStep)),
          stats::kNormal95 * std::sqrt(squares) / curvature};
}

/// Refits everything beside the spells.
SpellScan::Found refit(const SpellScan& scan, const Fitter& fitter, SpellScan::Found found, FitState& state) {
  constexpr int kRounds = 2;  // rounds of spells and fit, the first with the speed; more cost a fit each
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::vector<float>> shares;
    for (TrackSpells& track : found.tracks) shares.push_back(std::move(track.share));
    state.tracks.set_spells(std::move(shares));
    fitter.fit(state, 2);
    if (round == 0) state.model.stalls->gain = fitted_speed(scan, state.model, *state.model.stalls);
    found = scan.scan(state.model, *state.model.stalls);
    state.model.stalls = scan.refined(found, *state.model.stalls);
  }
  return scan.scan(state.model, *state.model.stalls);
}

/// The gain on robots whose spells take no part in the parameters of the stalls, and its standard error over tracks.
std::pair<double, double> cross_validated(const SpellScan& scan, const SpellScan::Found& found,
                                          const FitState& state) {
  // Of the robots of the fit; of its tracks, if there are few robots.
  std::set<std::uint32_t> robots;
  for (const TrackView& view : scan.views())
    if (!view.track->held_out) robots.insert(view.track->robot);
  const bool by_robot = robots.size() >= kRobotFolds;
  std::map<std::size_t, std::size_t> folds;  // by robot or view
  const auto key_of = [&](std::size_t v) { return by_robot ? scan.views()[v].track->robot : v; };
  std::size_t next = 0;
  for (std::size_t v = 0; v < scan.views().size(); ++v)
    if (!scan.views()[v].track->held_out && folds.try_emplace(key_of(v), next % kRobotFolds).second) ++next;
  const auto fold_of = [&](std::size_t v) {
    const auto at = folds.find(key_of(v));
    return at == folds.end() ? 0 : at->second;
  };
  std::vector<Stalls> without;
  for (std::size_t k = 0; k < kRobotFolds; ++k)
    without.push_back(scan.refined(found, *state.model.stalls, [&](std::size_t v) { return fold_of(v) != k; }));
  const SpellScan::Found judged = scan.scan(state.model, [&](std::size_t v) { return without[fold_of(v)]; });
  double tracks = 0, squares = 0;
  for (const TrackView& view : scan.views()) tracks += view.track->held_out ? 0 : 1;
  for (std::size_t v = 0; v < scan.views().size(); ++v)
    if (!scan.views()[v].track->held_out) squares += std::pow(judged.gains[v] - judged.gain / tracks, 2);
  return {judged.gain, std::sqrt(squares * tracks / std::max(tracks - 1, 1.0))};
}

}  // namespace

std::optional<StallEffect> find_stalls(const Fitter& fitter, FitState& state) {
  const SpellScan scan(state, fitter.threads());
  // Robots that stand still, and robots that lose half of their speed.
  std::pair<Stalls, double> best{{}, 0};
  for (const double speed : {0.0, 0.5})
    if (const auto one = first_fit(scan, state.model, speed); one.second > best.second) best = one;
  if (!(best.second > kLeastStallGain)) return std::nullopt;
  if (first_fit(scan, state.model, 2 - best.first.gain).second > kMostMirrored * best.second) return std::nullopt;
  FitState trial = state;
  trial.model.stalls = best.first;
  SpellScan::Found found = refit(scan, fitter, scan.scan(state.model, best.first), trial);
  StallEffect out;
  if (double& speed = trial.model.stalls->gain; speed > 0) {
    double half = 0;
    std::tie(speed, half) = speed_and_half(scan, trial.model, *trial.model.stalls);
    out.speed = {std::max(0.0, speed - half), std::min(1.0, speed + half)};
    found = scan.scan(trial.model, *trial.model.stalls);
  }
  out.stalls = *trial.model.stalls;
  out.spells = found.spells;
  out.gain = found.gain;
  out.degrees = kDegrees + (out.stalls.gain > 0 ? 1 : 0);
  out.log10_p = stats::log10_chi_squared_tail(2 * std::max(0.0, out.gain), out.degrees);
  if (out.spells < kFewestSpells || !(out.log10_p < kStallThreshold_log10_p) ||
      scan.dispersion(found) > kMostDispersion || scan.share_at_obstacles(found, trial.model) > kMostAtObstacles)
    return std::nullopt;
  // Last, since it costs a scan of its own.
  std::tie(out.held_out, out.held_out_se) = cross_validated(scan, found, trial);
  if (!(out.held_out > kLeastStallGain) || !(out.held_out > kLeastStallErrors * out.held_out_se))
    return std::nullopt;
  const SpellScan::Intervals intervals = scan.intervals(found, out.stalls);
  out.mean_apart_s = intervals.mean_apart_s;
  out.mean_length_s = intervals.mean_length_s;
  std::vector<std::vector<float>> shares;
  for (const TrackSpells& track : found.tracks) shares.push_back(track.share);
  trial.tracks.set_spells(std::move(shares));
  state = std::move(trial);
  return out;
}

namespace {

identification::Estimate number_of(const char* name, const char* unit, double value,
                                   const std::pair<double, double>& interval, const char* how) {
  identification::Estimate out;
  out.set_name(name);
  out.set_unit(unit);
  out.set_value(value);
  out.set_low(interval.first);
  if (std::isfinite(interval.second)) out.set_high(interval.second);
  out.set_how(how);
  return out;
}

}  // namespace

identification::Effect entry_of(const StallEffect& found) {
  const Stalls& stalls = found.stalls;
  identification::Effect out;
  out.set_name("stalls");
  out.add_covariates("episodes");
  out.set_acts_on("WHEEL_GAIN");
  identification::Evidence& evidence = *out.mutable_evidence();
  evidence.set_log10_p(found.log10_p);
  evidence.set_threshold_log10_p(kStallThreshold_log10_p);
  evidence.set_log_likelihood_gain(found.gain);
  *evidence.mutable_held_out_gain() = json_value(found.held_out);
  *evidence.mutable_held_out_gain_se() = json_value(found.held_out_se);
  evidence.set_degrees(found.degrees);
  auto& parameters = *out.mutable_parameters()->mutable_fields();
  parameters["form"] = json_value("episodes");
  parameters["spells"] = json_value(static_cast<double>(found.spells));
  parameters["mean_apart_s"] = json_value(stalls.mean_apart_s);
  parameters["scale_s"] = json_value(stalls.scale_s);
  parameters["tail"] = json_value(stalls.tail);
  parameters["shape"] = json_value(stalls.shape);
  parameters["mean_length_s"] = json_value(stalls.mean_length_s());
  parameters["share_of_time"] = json_value(stalls.share());
  parameters["speed"] = json_value(stalls.gain);
  *out.add_numbers() = number_of("mean time from one spell to the next", "s", stalls.mean_apart_s,
                                 found.mean_apart_s, "number of spells found, a Poisson variable");
  *out.add_numbers() = number_of("mean duration", "s", stalls.mean_length_s(), found.mean_length_s,
                                 "posterior distribution of the law of the durations");
  if (found.speed)
    *out.add_numbers() = number_of("speed within spells", "", stalls.gain, *found.speed,
                                   "likelihood, with the spread of its slope over tracks; all else as fitted");
  *out.mutable_rmse_without_mm() = json_null();
  *out.mutable_share_removed() = json_null();
  const std::string in_scales = fmt::format("t / {:.1f} s", stalls.scale_s);
  out.set_in_words(fmt::format(
      "robots {} at random although a motor is on: {:.0f} s from one spell to the next on average, P(duration > t) "
      "= "
      "(1 + {})^-{:.1f}, {:.1f} s on average",
      stalls.gain > 0 ? fmt::format("slip to {:.0f} % of their speed", 100 * stalls.gain) : "stand still",
      stalls.mean_apart_s, stalls.shape == 1 ? in_scales : fmt::format("({})^{:.1f}", in_scales, stalls.shape),
      stalls.tail, stalls.mean_length_s()));
  return out;
}

}  // namespace kilotwin::identify

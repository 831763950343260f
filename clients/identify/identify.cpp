#include "clients/identify/identify.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "clients/identify/document.hpp"
#include "clients/identify/findings.hpp"
#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/persistent_residuals.hpp"
#include "clients/identify/fit/posterior_draws.hpp"
#include "clients/identify/last_check.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/replay/simulation_check.hpp"
#include "clients/identify/search/floor_parts.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/unexplained/prediction_windows.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

/// Joint Monte Carlo rollouts of the predictions that are reported.
constexpr std::uint32_t kRollouts = 64;
/// The same of the last check, which compares models by equal draws: enough for robots that may or may not touch.
constexpr std::uint32_t kRolloutsToChoose = 16;
constexpr std::uint32_t kDrawsSeed = 1;

/// Windows of the tracks of the fit.
std::vector<Window> fitted_windows(const FitState& fit, const std::vector<Forecast>& forecasts, double horizon_s) {
  std::vector<Forecast> of_fit;
  for (const Forecast& f : forecasts)
    if (!fit.tracks.set().runs[f.run].tracks[f.place].held_out) of_fit.push_back(f);
  return windows_of(fit.tracks, of_fit, horizon_s);
}

/// The model as it would be if only the white part of its process noise were noise: it expects smaller errors of itself.
FitState with_white_noise(const Fitter& fitter, const FitState& fit) {
  FitState white = fit;
  white.model.noise = white_part(fit.model.noise, persistent_share(fitter, fit));
  return white;
}

/// Errors, their intervals and floors, and what remains unexplained.
void assess(Findings& f, const Fitter& fitter, const MeasuredSet& train, const MeasuredSet* test,
            const Evaluation& evaluation, const ForecastTimes& reported) {
  ForecastTimes times = reported;
  times.rollouts = 0;
  const std::uint32_t threads = fitter.threads();
  const std::vector<Forecast> fitted =
      forecast(f.found.fit.model, f.found.fit.tracks, times, Tracks::kAll, threads);
  const auto errors_of_free = [&](const Judged& judged) {
    return errors_of(evaluation.set(),
                     free_ones(f.found.fit.model, f.after.tracks, judged.forecasts, times.horizon_s));
  };
  f.free_before = errors_of_free(f.before);
  f.free_after = errors_of_free(f.after);
  f.bounds = bounds_of(evaluation.set(), f.before.errors, f.after.errors);
  const FitState white = with_white_noise(fitter, f.found.fit);
  f.white = white.model.noise;
  std::vector<Forecast> held_out = f.after.forecasts;
  if (gives_errors(f.held_out)) {
    held_out = with_expectations_of(evaluation.judge(white, reported).forecasts, std::move(held_out));
    f.after.errors = errors_of(evaluation.set(), held_out);
    f.expected_mm = f.after.errors.expected_mm();
  } else {
    f.expected_mm =
        errors_of(train, forecast(white.model, white.tracks, times, Tracks::kAll, threads)).expected_mm();
  }
  std::vector<std::pair<const MeasuredSet*, const std::vector<Forecast>*>> all{{&train, &fitted}};
  if (test != nullptr) all.emplace_back(test, &f.after.forecasts);
  f.replicates = replicates_of(all, times.horizon_s);
  const std::vector<Forecast> known = from_known_starts(held_out);
  std::optional<HeldOutErrors> known_starts;
  if (known.size() < held_out.size()) {
    const PredictionErrors errors = errors_of(evaluation.set(), known);
    known_starts = HeldOutErrors{errors, bounds_of(evaluation.set(), errors, errors)};
  }
  f.unexplained =
      find_unexplained(gives_errors(f.held_out) ? evaluation.set() : train,
                       fitted_windows(f.found.fit, from_known_starts(fitted), times.horizon_s),
                       windows_of(f.after.tracks, known, times.horizon_s), {f.after.errors, f.bounds}, known_starts,
                       f.replicates, threads, {std::max(20.0, 2 * times.horizon_s), !f.numbering.anew()});
}

/// Errors over the horizon, if anything is held out.
void add_horizon(identification::Identification& out, const Findings& f, const Evaluation& evaluation,
                 std::uint32_t threads) {
  if (!gives_errors(f.held_out)) return;
  identification::Horizon& curve = *out.mutable_horizon();
  for (const double ahead_s : {1.0, 2.0, 5.0, 10.0, 15.0, 20.0}) {
    const ForecastTimes at{20, 10, ahead_s};
    const auto errors = [&](const MotionModel& model, const PreparedSet& tracks) {
      return errors_of(evaluation.set(), forecast(model, tracks, at, evaluation.of(), threads));
    };
    MotionModel white = f.found.fit.model;
    white.noise = f.white;
    const PredictionErrors was = errors(f.base.model, f.before.tracks),
                           is = errors(f.found.fit.model, f.after.tracks);
    if (was.rows == 0 || is.rows == 0) continue;  // no sample within a tenth of this horizon
    curve.add_at_s(ahead_s);
    curve.add_before_mm(was.rmse_mm());
    curve.add_after_mm(is.rmse_mm());
    curve.add_floor_mm(errors(white, f.after.tracks).expected_mm());
  }
}

std::vector<Prediction> predictions_of(const Findings& f, const MeasuredSet& judged) {
  std::vector<Prediction> out;
  for (std::size_t i = 0; i < f.before.forecasts.size(); ++i) {
    const Forecast &b = f.before.forecasts[i], &a = f.after.forecasts[i];
    KILOTWIN_DEMAND(b.run == a.run && b.place == a.place && b.time_s == a.time_s);
    const Run& run = judged.runs[b.run];
    out.push_back({run.name, run.tracks[b.place].robot, b.time_s, b.x_mm, b.y_mm, a.x_mm, a.y_mm});
  }
  return out;
}

/// The written model with an ambiguous effect exchanged for its alternative, refitted. The closest alternatives first.
std::vector<std::pair<std::string, proto::Model>> candidates_of(const Findings& f, const Fitter& fitter) {
  constexpr std::size_t kMost = 3;
  std::vector<Ambiguity> closest = f.found.ambiguous;
  std::stable_sort(closest.begin(), closest.end(), [](const Ambiguity& a, const Ambiguity& b) {
    return a.evidence_difference < b.evidence_difference;
  });
  std::vector<std::pair<std::string, proto::Model>> out;
  for (const Ambiguity& a : closest) {
    const std::vector<Term>& terms = f.found.fit.model.terms;
    const auto at = std::find_if(terms.begin(), terms.end(), [&](const Term& t) { return t.name == a.found; });
    const bool known = std::any_of(out.begin(), out.end(), [&](const auto& c) { return c.first == a.instead; });
    if (!a.alternative || at == terms.end() || known || out.size() == kMost) continue;
    FitState rival = f.found.fit;
    rival.model.terms[static_cast<std::size_t>(at - terms.begin())] = *a.alternative;
    fitter.fit(rival, 2);
    // Written models differ in the effect alone.
    rival.model.noise = f.found.fit.model.noise;
    out.emplace_back(a.instead, proto_of(rival.model));
    write_noise_effects(out.back().second, rival.model.noise, f.noise_effects);
  }
  return out;
}

/// A model of a part of the training data, refitted to all of them.
FitState refitted(const Fitter& fitter, const FitState& part, const MeasuredSet& whole) {
  FitState all(whole);
  all.model = part.model;
  all.scale = part.scale;
  all.tracks.set_command_lag(part.model.base.command_lag_s);
  all.tracks.find_centres(all.model, fitter.threads());
  fitter.fit(all, 2);
  refit_tables(fitter, all);
  return all;
}

/// The search on the tracks of the fit; without effects the base model alone.
Search found_by_search(const Fitter& fitter, const FitState& base, const MeasuredSet& train,
                       const ForecastTimes& times, const Options& options, const WorkLog& log) {
  Search found{base, {}, {{base, {}}}, {}, {}, {}, {}};
  if (!options.find_effects) return found;
  const auto leaves_much = [&](const FitState& fit) {
    const std::vector<Forecast> all = forecast(fit.model, fit.tracks, times, Tracks::kFit, options.threads);
    const FitState white = with_white_noise(fitter, fit);
    const std::vector<Forecast> expected = forecast(white.model, fit.tracks, times, Tracks::kFit, options.threads);
    // Motion in contact is uncertain, and no effect.
    const std::vector<Forecast> free =
        from_known_starts(free_ones(fit.model, fit.tracks, with_expectations_of(expected, all), options.horizon_s));
    const PredictionErrors errors = errors_of(train, free);
    return leaves_systematic_error(train, windows_of(fit.tracks, free, options.horizon_s), errors, options.threads);
  };
  found = search(fitter, base, log, leaves_much);
  log.begin(kTermChecks, "search", "checking each effect", found.fit.model.terms.size());
  keep_predictive_terms(fitter, train, times, found);
  fit_floor_parts(fitter, found);
  return found;
}

/// The noise that is written and reported, with its intervals.
void set_noise(Findings& f, const Fitter& fitter) {
  f.noise = fitter.noise_interval(f.found.fit);
  f.found.fit.model.noise = f.noise.most_likely;
}

/// Stalls, and the noise beside them, in place of the model without. They are looked for in the tracks of the fit. They stay unless the
/// tracks that choose are predicted worse, beyond chance. Short stalls predict no better, for the mean speed includes them: what they
/// explain is the spread.
void choose_stalls(Findings& f, const Fitter& fitter, const Evaluation& choosing, const ForecastTimes& times) {
  FitState with = f.found.fit;
  f.stalls = find_stalls(fitter, with);
  if (!f.stalls) return;
  const PredictionErrors without = choosing.judge(f.found.fit, times).errors,
                         errors = choosing.judge(with, times).errors;
  const auto bounds = bounds_of(choosing.set(), without, errors);
  // Negated, so that an error that is no number is no reason to write them.
  if (bounds ? bounds->less_by.high_mm >= 0 : errors.rmse_mm() <= without.rmse_mm()) {
    f.found.fit = std::move(with);
    return;
  }
  f.found.rejected.insert(f.found.rejected.begin(), {"stalls",
                                                     {"episodes"},
                                                     "wheel speed",
                                                     f.stalls->log10_p,
                                                     kStallThreshold_log10_p,
                                                     "held-out data are predicted worse with it, beyond chance"});
  f.stalls.reset();
}

/// The last check, with stalls; then, beside a test set, the refit to all of the training data.
void choose(Findings& f, const Fitter& fitter, const MeasuredSet& train, const MeasuredSet& whole,
            const Evaluation& evaluation, const ForecastTimes& reported, bool find_effects) {
  const Evaluation apart(train, nullptr, Tracks::kChoosing, fitter.threads());
  ForecastTimes fast = reported, times = reported;
  fast.rollouts = 0;
  const auto predicts = [&](const Evaluation& on) { return on.judge(f.base, fast).errors.rows > 0; };
  const bool has_others = evaluation.of() != Tracks::kHeldOut && predicts(apart);
  f.check.chose_on_reported = !has_others && evaluation.held_out() != HeldOut::kTestSet && predicts(evaluation);
  if (has_others) times.rollouts = kRolloutsToChoose;
  if (has_others || f.check.chose_on_reported)
    choose_on_held_out(f, fitter, has_others ? apart : evaluation, times);
  const bool is_base = f.found.fit.model.terms.empty() && f.found.fit.model.base.command_lag_s == 0;
  const auto finish = [&] {
    set_noise(f, fitter);
    if (is_base) f.base = f.found.fit;
  };
  finish();
  // Where no track is left to choose, those of the fit have to.
  const Evaluation fitted(train, nullptr, Tracks::kFit, fitter.threads());
  if (find_effects)
    choose_stalls(f, fitter, has_others ? apart : f.check.chose_on_reported ? evaluation : fitted, reported);
  if (&whole != &train) {
    f.found.fit.model.stalls.reset();
    f.base = refitted(fitter, f.base, whole);
    f.found.fit = is_base ? f.base : refitted(fitter, f.found.fit, whole);
    finish();
    if (f.stalls) f.stalls = find_stalls(fitter, f.found.fit);
  }
  if (f.stalls) set_noise(f, fitter);
}

/// The errors that are reported.
void judge(Findings& f, const Fitter& fitter, const Evaluation& evaluation, const ForecastTimes& reported) {
  f.before = evaluation.judge(f.base, reported);
  f.after = evaluation.judge(f.found.fit, reported);
  // A model that diverges gives no prediction for some rows.
  if (f.after.forecasts.size() != f.before.forecasts.size()) {
    keep_base_model(f);
    f.stalls.reset();
    set_noise(f, fitter);
    f.base = f.found.fit;
    f.after = f.before = evaluation.judge(f.base, reported);
  }
  if (gives_errors(f.held_out) && f.before.errors.rows == 0) f.held_out = HeldOut::kNoTime;
  if (!gives_errors(f.held_out)) return;
  for (std::size_t t = 0; t < f.found.fit.model.terms.size(); ++t)
    f.rmse_without_mm.push_back(evaluation.judge(without_term(fitter, f.found.fit, t), reported).errors.rmse_mm());
}

/// The held-out tracks that give the error: those that do not choose, or all if none of them is measured near a predicted time.
Tracks reporting_tracks(const MeasuredSet& train, const MeasuredSet* test, const FitState& base,
                        const ForecastTimes& times, std::uint32_t threads) {
  if (test != nullptr) return Tracks::kAll;
  const Evaluation reporting(train, nullptr, Tracks::kReporting, threads);
  return reporting.judge(base, times).errors.rows > 0 ? Tracks::kReporting : Tracks::kHeldOut;
}

}  // namespace

Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options& options) {
  const WorkLog log(options.progress);
  FitState base(train);
  if (base.tracks.units().empty())
    throw UserError("no track of the training runs has two samples; give longer tracks");
  const ForecastTimes times{10, 5, options.horizon_s};
  ForecastTimes reported = times;
  reported.rollouts = kRollouts;

  log.begin(kBaseModel, "base model", "fitting", 0,
            options.find_effects ? std::optional(kMostRounds) : std::nullopt);
  const Fitter fitter(train, options.threads);
  fitter.fit_base(base);
  const Evaluation evaluation(train, test, reporting_tracks(train, test, base, times, options.threads),
                              options.threads);
  Findings f{base, found_by_search(fitter, base, train, times, options, log)};
  f.held_out = evaluation.held_out();
  f.model_file = options.model_file;
  const auto begin = [&](WorkKind kind, const char* stage) {
    log.begin(kind, stage, "", f.found.fit.model.terms.size());
  };
  begin(kLastCheck, "last check on held-out data");
  MeasuredSet all_fitted = train;
  for (Run& run : all_fitted.runs)
    for (Track& track : run.tracks) track.held_out = track.chooses = false;
  choose(f, fitter, train, test != nullptr ? all_fitted : train, evaluation, reported, options.find_effects);
  begin(kErrors, "prediction errors");
  judge(f, fitter, evaluation, reported);
  begin(kUnexplained, "what is left unexplained");
  f.numbering = numbering_of(fitter, f.base);
  // An effect that the base model lacks makes the robots' speeds differ from run to run.
  if (f.numbering.anew()) f.numbering = numbering_of(fitter, f.found.fit);
  assess(f, fitter, train, test, evaluation, reported);
  f.uncertainty = uncertainty_of(fitter, f.found.fit);
  f.steps = step_intervals_of(fitter, f.found.fit, f.uncertainty);
  f.geometry = geometry_intervals_of(fitter, f.found.fit, f.uncertainty);
  if (f.found.fit.model.base.command_lag_s != 0) f.command_lag_s = fitter.command_lag_interval(f.found.fit);
  const std::vector<NoiseSample> noise_samples = noise_samples_of(f.found.fit, options.threads);
  f.noise_ratios = noise_ratios_of(noise_samples);
  if (options.find_effects) f.noise_effects = find_noise_effects(noise_samples);

  Identified out;
  out.predictions = predictions_of(f, evaluation.set());
  out.found = document_of(f, train, test, options.horizon_s, options.threads);
  begin(kHorizon, "errors over the horizon");
  add_horizon(out.found, f, evaluation, options.threads);
  begin(kSimulation, "simulation check");
  out.model = proto_of(f.found.fit.model);
  write_noise_effects(out.model, f.found.fit.model.noise, f.noise_effects);
  out.candidates = candidates_of(f, fitter);
  const PosteriorDraws posterior(f.found.fit.model, f.uncertainty);
  for (std::uint32_t n = 1; n <= options.draws; ++n) {
    out.draws.push_back(proto_of(posterior.draw(kDrawsSeed, n)));
    write_noise_effects(out.draws.back(), f.found.fit.model.noise, f.noise_effects);
  }
  const proto::Model written_before = proto_of(f.base.model);
  // Simulations give no error that a choice could make too small: all held-out tracks count.
  const Tracks compared = test != nullptr ? Tracks::kAll : Tracks::kHeldOut;
  add_simulation_check({f.base.model, written_before}, {f.found.fit.model, out.model}, f.after.tracks, compared,
                       options.threads, out.found);
  return out;
}

}  // namespace kilotwin::identify

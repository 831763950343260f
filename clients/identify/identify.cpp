#include "clients/identify/identify.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "clients/identify/document.hpp"
#include "clients/identify/findings.hpp"
#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/fit/posterior_draws.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/predict/final_check.hpp"
#include "clients/identify/replay/simulation_check.hpp"
#include "clients/identify/unexplained/prediction_windows.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

/// Joint Monte Carlo rollouts of the predictions that are reported.
constexpr std::uint32_t kRollouts = 64;
constexpr std::uint32_t kDrawsSeed = 1;

FitState without_term(const Fitter& fitter, const FitState& fit, std::size_t t) {
  FitState less = fit;
  less.model.terms.erase(less.model.terms.begin() + static_cast<std::ptrdiff_t>(t));
  fitter.fit(less, 1);
  return less;
}

void take_out(Search& found, std::size_t t, FitState without) {
  found.fit = std::move(without);
  found.reasons.erase(found.reasons.begin() + static_cast<std::ptrdiff_t>(t));
}

/// Removes terms that do not reduce the error of the training data at the prediction horizon. A small p one step ahead
/// does not suffice.
void keep_predictive_terms(const Fitter& fitter, const MeasuredSet& train, const ForecastTimes& times,
                           Search& found) {
  const auto error_mm = [&](const FitState& state) {
    return errors_of(train, forecast(state.model, state.tracks, times, false, fitter.threads())).rmse_mm();
  };
  if (found.fit.model.terms.empty()) return;
  double with_mm = error_mm(found.fit);
  for (std::size_t t = found.fit.model.terms.size(); t-- > 0;) {
    FitState without = without_term(fitter, found.fit, t);
    const double without_mm = error_mm(without);
    // Measurement effects rarely change predicted positions, so they need not reduce the error. They must not
    // raise it.
    const bool on_measurement = is_measured(found.fit.model.terms[t].blocks.front().target);
    if (without_mm > with_mm * (on_measurement ? 0.9995 : 1.0005)) continue;
    take_out(found, t, std::move(without));
    with_mm = without_mm;
  }
}

/// The models on the way of the search with fewer terms than its result, and the result.
std::vector<Stage> path_to(const Search& found) {
  std::vector<Stage> path;
  const std::size_t terms = found.fit.model.terms.size();
  std::copy_if(found.path.begin(), found.path.end(), std::back_inserter(path),
               [&](const Stage& stage) { return stage.fit.model.terms.size() < terms; });
  if (terms == 0) path.push_back(found.path.front());
  if (terms == 0 && found.fit.model.base.command_lag_s == path.front().fit.model.base.command_lag_s) return path;
  path.push_back({found.fit, found.reasons});
  return path;
}

std::vector<std::string> effects_of(const MotionModel& model) {
  std::vector<std::string> names;
  for (const Term& term : model.terms)
    if (std::find(names.begin(), names.end(), term.name) == names.end()) names.push_back(term.name);
  return names;
}

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Everything about dropped effects leaves the findings, except that they were dropped.
void note_dropped(Findings& f, const std::vector<Stage>& path) {
  const std::vector<std::string> kept = effects_of(f.found.fit.model);
  const Stage& last = path.back();
  for (std::size_t t = 0; t < last.fit.model.terms.size(); ++t) {
    const std::string& name = last.fit.model.terms[t].name;
    if (holds(kept, name) || holds(f.check.dropped, name)) continue;
    f.check.dropped.push_back(name);
    const Reason& reason = last.reasons[t];
    f.found.rejected.insert(f.found.rejected.begin(),
                            {name, reason.covariates, reason.acts_on, reason.finding.log10_p,
                             reason.threshold_log10_p, "held-out data are predicted no better with it"});
  }
  std::erase_if(f.found.steps, [&](const Step& step) { return !holds(kept, step.added); });
  std::erase_if(f.found.ambiguous, [&](const Ambiguity& a) { return !holds(kept, a.found); });
}

/// The last check: goes back along the path of the search until held-out data are not predicted worse.
void check_on_held_out(Findings& f, const Evaluation& evaluation, const ForecastTimes& times,
                       const ForecastTimes& reported, const std::vector<Stage>& path) {
  std::vector<PredictionErrors> errors;
  for (const Stage& stage : path) {
    errors.push_back(evaluation.judge(stage.fit, times).errors);
    f.check.path.push_back({effects_of(stage.fit.model), errors.back().rmse_mm()});
  }
  for (std::size_t k = last_not_worse(evaluation.set(), errors);;) {
    f.check.kept = k;
    f.found.fit = path[k].fit;
    f.found.reasons = path[k].reasons;
    f.after = k == 0 ? f.before : evaluation.judge(f.found.fit, reported);
    // The reported predictions have rollouts.
    if (k == 0 || last_not_worse(evaluation.set(), {f.before.errors, f.after.errors}) == 1) return;
    errors.resize(k);
    k = last_not_worse(evaluation.set(), errors);
  }
}

/// Evaluates each term on held-out data. A term that lowers their likelihood and does not lower their prediction error is
/// removed.
void check_terms(Findings& f, const Fitter& fitter, const Evaluation& evaluation, const ForecastTimes& times,
                 const ForecastTimes& reported) {
  constexpr double kSame = 1e-3;
  for (bool changed = true; changed;) {
    changed = false;
    f.terms.clear();
    if (f.found.fit.model.terms.empty()) return;
    const double with_mm = evaluation.judge(f.found.fit, times).errors.rmse_mm();
    for (std::size_t t = 0; t < f.found.fit.model.terms.size(); ++t) {
      FitState less = without_term(fitter, f.found.fit, t);
      const double without_mm = evaluation.judge(less, times).errors.rmse_mm();
      const HeldOutGain gain =
          held_out_gain(f.found.fit.model, less.model, f.after.tracks, evaluation.marked_only(), fitter.threads());
      f.terms.push_back({std::move(less), without_mm, gain});
    }
    for (std::size_t t = f.terms.size(); t-- > 0 && !changed;) {
      if (f.terms[t].gain.nat >= 0 || f.terms[t].rmse_without_mm > with_mm * (1 + kSame)) continue;
      take_out(f.found, t, f.terms[t].without);
      f.after = evaluation.judge(f.found.fit, reported);
      changed = true;
    }
  }
}

/// Windows of the tracks of the fit.
std::vector<Window> fitted_windows(const FitState& fit, const std::vector<Forecast>& forecasts, double horizon_s) {
  std::vector<Forecast> of_fit;
  for (const Forecast& f : forecasts)
    if (!fit.tracks.set().runs[f.run].tracks[f.place].held_out) of_fit.push_back(f);
  return windows_of(fit.tracks, of_fit, horizon_s);
}

/// Errors on the tracks of the fit.
PredictionErrors fitted_errors(const MeasuredSet& train, const std::vector<Forecast>& forecasts) {
  std::vector<Forecast> of_fit;
  for (const Forecast& f : forecasts)
    if (!train.runs[f.run].tracks[f.place].held_out) of_fit.push_back(f);
  return errors_of(train, of_fit);
}

/// Errors, their intervals and floors, and what remains unexplained.
void assess(Findings& f, const MeasuredSet& train, const MeasuredSet* test, const Evaluation& evaluation,
            const ForecastTimes& times, std::uint32_t threads) {
  const std::vector<Forecast> fitted = forecast(f.found.fit.model, f.found.fit.tracks, times, false, threads);
  const auto errors_of_free = [&](const Judged& judged) {
    return errors_of(evaluation.set(),
                     free_ones(f.found.fit.model, f.after.tracks, judged.forecasts, times.horizon_s));
  };
  f.free_before = errors_of_free(f.before);
  f.free_after = errors_of_free(f.after);
  f.bounds = bounds_of(evaluation.set(), f.before.errors, f.after.errors);
  f.expected_mm = (gives_errors(f.held_out) ? f.after.errors : errors_of(train, fitted)).expected_mm();
  std::vector<std::pair<const MeasuredSet*, const std::vector<Forecast>*>> all{{&train, &fitted}};
  if (test != nullptr) all.emplace_back(test, &f.after.forecasts);
  f.replicates = replicates_of(all, times.horizon_s);
  f.unexplained = find_unexplained(
      gives_errors(f.held_out) ? evaluation.set() : train, fitted_windows(f.found.fit, fitted, times.horizon_s),
      windows_of(f.after.tracks, f.after.forecasts, times.horizon_s), f.after.errors, f.bounds, f.replicates);
}

/// Errors over the horizon; empty if nothing is held out.
nlohmann::json horizon_curve(const Findings& f, const Evaluation& evaluation, std::uint32_t threads) {
  nlohmann::json curve;
  if (!gives_errors(f.held_out)) return curve;
  for (const double ahead_s : {1.0, 2.0, 5.0, 10.0, 15.0, 20.0}) {
    const ForecastTimes at{20, 10, ahead_s};
    const auto errors = [&](const MotionModel& model, const PreparedSet& tracks) {
      return errors_of(evaluation.set(), forecast(model, tracks, at, evaluation.marked_only(), threads));
    };
    const PredictionErrors was = errors(f.base.model, f.before.tracks),
                           is = errors(f.found.fit.model, f.after.tracks);
    curve["at_s"].push_back(ahead_s);
    curve["before_mm"].push_back(was.rmse_mm());
    curve["after_mm"].push_back(is.rmse_mm());
    curve["floor_mm"].push_back(is.expected_mm());
  }
  return curve;
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

}  // namespace

Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options& options) {
  const auto say_progress = [&](double part, const std::string& what) {
    if (options.progress) options.progress(part, what);
  };
  const auto started = std::chrono::steady_clock::now();
  FitState base(train);
  if (base.tracks.units().empty())
    throw UserError("no track of the training runs has two samples; give longer tracks");
  const Evaluation evaluation(train, test, options.threads);
  const ForecastTimes times{10, 5, options.horizon_s};
  ForecastTimes reported = times;
  reported.rollouts = kRollouts;

  say_progress(0.02, "base model");
  const Fitter fitter(train, options.threads);
  fitter.fit_base(base);
  Search found{base, {}, {{base, {}}}, {}, {}, {}};
  if (options.find_effects) {
    const auto leaves_much = [&](const FitState& fit) {
      // What robots do in contact is uncertain, and no effect.
      const std::vector<Forecast> forecasts = free_ones(
          fit.model, fit.tracks, forecast(fit.model, fit.tracks, times, false, options.threads), options.horizon_s);
      return leaves_systematic_error(train, fitted_windows(fit, forecasts, options.horizon_s),
                                     fitted_errors(train, forecasts));
    };
    found = search(
        fitter, base, [&](double part, const std::string& what) { say_progress(0.1 + 0.75 * part, what); },
        leaves_much);
  }
  say_progress(0.85, "evaluating each effect");
  keep_predictive_terms(fitter, train, times, found);
  const std::vector<Stage> path = path_to(found);

  say_progress(0.88, "predictions");
  const Judged before = evaluation.judge(base, reported);
  Findings f{base, std::move(found),  evaluation.held_out(), before, before, {}, {}, {}, 0, {}, {}, {}, {}, {},
             {},   options.model_file};
  if (gives_errors(f.held_out) && before.errors.rows == 0) f.held_out = HeldOut::kNoTime;
  if (!gives_errors(f.held_out)) {
    f.after = evaluation.judge(f.found.fit, reported);
  } else {
    check_on_held_out(f, evaluation, times, reported, path);
    check_terms(f, fitter, evaluation, times, reported);
    note_dropped(f, path);
  }
  say_progress(0.91, "what is left unexplained");
  assess(f, train, test, evaluation, times, options.threads);
  f.numbering = numbering_of(fitter, f.base);
  f.uncertainty = uncertainty_of(fitter, f.found.fit);

  Identified out;
  out.predictions = predictions_of(f, evaluation.set());
  out.document = document_of(f, train, test, options.horizon_s, options.threads);
  say_progress(0.93, "errors over the horizon");
  out.document["horizon"] = horizon_curve(f, evaluation, options.threads);
  say_progress(0.95, "simulation check");
  out.model = proto_of(f.found.fit.model);
  const PosteriorDraws posterior(f.found.fit.model, f.uncertainty);
  for (std::uint32_t n = 1; n <= options.draws; ++n) out.draws.push_back(proto_of(posterior.draw(kDrawsSeed, n)));
  const proto::Model written_before = proto_of(f.base.model);
  const nlohmann::json simulated = simulation_check({f.base.model, written_before}, {f.found.fit.model, out.model},
                                                    f.after.tracks, evaluation.marked_only(), options.threads);
  for (const auto& [part, content] : simulated.items())
    (part == "simulated" ? out.document["contract"] : out.document)[part] = content;
  out.document["seconds"]["all"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  say_progress(1, "done");
  return out;
}

}  // namespace kilotwin::identify

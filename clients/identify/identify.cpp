#include "clients/identify/identify.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
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
#include "clients/identify/search/products.hpp"
#include "clients/identify/study.hpp"
#include "clients/identify/track_search.hpp"
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
  constexpr std::size_t kMost = 3;  // alternatives, the closest; each costs a fit
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

/// The noise that is written and reported, with its intervals.
void set_noise(Findings& f, const Fitter& fitter) {
  f.noise = fitter.noise_interval(f.found.fit);
  f.found.fit.model.noise = f.noise.most_likely;
}

void reject_stalls(Findings& f, const char* why) {
  f.found.rejected.insert(f.found.rejected.begin(),
                          {"stalls", {"episodes"}, "wheel speed", f.stalls->log10_p, kStallThreshold_log10_p, why});
  f.stalls.reset();
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
  reject_stalls(f, "held-out data are predicted worse with it, beyond chance");
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
    if (f.stalls) {
      if (auto again = find_stalls(fitter, f.found.fit))
        f.stalls = std::move(again);
      else
        reject_stalls(f, "not significant in all training data together");
    }
  }
  if (f.stalls) set_noise(f, fitter);
}

/// The errors that are reported.
void judge_errors(Findings& f, const Fitter& fitter, const Evaluation& evaluation, const ForecastTimes& reported) {
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

/// The set without a track that is held out.
MeasuredSet all_fitted(MeasuredSet set) {
  for (Run& run : set.runs)
    for (Track& track : run.tracks) track.held_out = track.chooses = false;
  return set;
}

/// The study of measured tracks.
class TrackStudy final : public Study {
 public:
  TrackStudy(MeasuredSet train, std::optional<MeasuredSet> test, std::vector<DataFault> faults, Options options);
  void fit() override;
  void search() override;
  void judge() override;
  Identified report() override;

 private:
  [[nodiscard]] const MeasuredSet* test() const { return test_ ? &*test_ : nullptr; }
  void begin(WorkKind kind, const char* stage) { log_.begin(kind, stage, "", f_.found.fit.model.terms.size()); }
  void add_models(Identified& out) const;

  const MeasuredSet train_;
  const MeasuredSet whole_train_;  ///< the same without tracks that are held out
  const std::optional<MeasuredSet> test_;
  const std::vector<DataFault> faults_;
  const Options options_;
  const ForecastTimes times_;
  ForecastTimes reported_;  ///< the same, by rollouts
  const WorkLog log_;
  Findings f_;
  const Fitter fitter_;
  std::optional<Evaluation> evaluation_;
};

/// The base model before its fit.
Findings unfitted(const MeasuredSet& train) {
  FitState base(train);
  if (base.tracks.units().empty())
    throw UserError("no track of the training runs has two samples; give longer tracks");
  return {base, {base, {}, {{base, {}}}, {}, {}, {}, {}}};
}

TrackStudy::TrackStudy(MeasuredSet train, std::optional<MeasuredSet> test, std::vector<DataFault> faults,
                       Options options)
    : train_(std::move(train)),
      whole_train_(all_fitted(train_)),
      test_(std::move(test)),
      faults_(std::move(faults)),
      options_(std::move(options)),
      times_{10, 5, options_.horizon_s},
      reported_(times_),
      log_(options_.progress),
      f_(unfitted(train_)),
      fitter_(train_, options_.threads) {
  reported_.rollouts = kRollouts;
  f_.model_file = options_.model_file;
}

void TrackStudy::fit() {
  log_.begin(kBaseModel, "base model", "fitting", 0,
             options_.find_effects ? std::optional(kMostRounds) : std::nullopt);
  fitter_.fit_base(f_.base);
  f_.found.fit = f_.base;
  f_.found.path = {{f_.base, {}}};
}

void TrackStudy::search() { f_.found = search_tracks(fitter_, f_.base, train_, times_, log_); }

void TrackStudy::judge() {
  evaluation_.emplace(train_, test(), reporting_tracks(train_, test(), f_.base, times_, options_.threads),
                      options_.threads);
  f_.held_out = evaluation_->held_out();
  begin(kLastCheck, "last check on held-out data");
  choose(f_, fitter_, train_, test_ ? whole_train_ : train_, *evaluation_, reported_, options_.find_effects);
  begin(kErrors, "prediction errors");
  judge_errors(f_, fitter_, *evaluation_, reported_);
  begin(kUnexplained, "what is left unexplained");
  f_.numbering = numbering_of(fitter_, f_.base);
  // An effect that the base model lacks makes the robots' speeds differ from run to run.
  if (f_.numbering.anew()) f_.numbering = numbering_of(fitter_, f_.found.fit);
  assess(f_, fitter_, train_, test(), *evaluation_, reported_);
}

/// The written model, models that the data do not tell from it, and draws from its posterior.
void TrackStudy::add_models(Identified& out) const {
  const FitState& fit = f_.found.fit;
  out.model = proto_of(fit.model);
  write_noise_effects(out.model, fit.model.noise, f_.noise_effects);
  out.candidates = candidates_of(f_, fitter_);
  const PosteriorDraws posterior(fit.model, f_.uncertainty);
  for (std::uint32_t n = 1; n <= options_.draws; ++n) {
    out.draws.push_back(proto_of(posterior.draw(kDrawsSeed, n)));
    write_noise_effects(out.draws.back(), fit.model.noise, f_.noise_effects);
  }
}

Identified TrackStudy::report() {
  const FitState& fit = f_.found.fit;
  f_.uncertainty = uncertainty_of(fitter_, fit);
  f_.steps = step_intervals_of(fitter_, fit, f_.uncertainty);
  f_.geometry = geometry_intervals_of(fitter_, fit, f_.uncertainty);
  if (fit.model.base.command_lag_s != 0) f_.command_lag_s = fitter_.command_lag_interval(fit);
  const std::vector<NoiseSample> noise_samples = noise_samples_of(fit, options_.threads);
  f_.noise_ratios = noise_ratios_of(noise_samples);
  if (options_.find_effects) f_.noise_effects = find_noise_effects(noise_samples);

  Identified out;
  out.predictions = predictions_of(f_, evaluation_->set());
  out.found = document_of(f_, train_, test(), options_.horizon_s, options_.threads);
  begin(kHorizon, "errors over the horizon");
  add_horizon(out.found, f_, *evaluation_, options_.threads);
  begin(kSimulation, "simulation check");
  add_models(out);
  const proto::Model written_before = proto_of(f_.base.model);
  // Simulations give no error that a choice could make too small: all held-out tracks count.
  const Tracks compared = test_ ? Tracks::kAll : Tracks::kHeldOut;
  add_simulation_check({f_.base.model, written_before}, {fit.model, out.model}, f_.after.tracks, compared,
                       options_.threads, out.found);
  add_faults(*out.found.mutable_result(), faults_);
  return out;
}

}  // namespace

std::unique_ptr<Study> track_study(MeasuredSet train, std::optional<MeasuredSet> test,
                                   std::vector<DataFault> faults, const Options& options) {
  return std::make_unique<TrackStudy>(std::move(train), std::move(test), std::move(faults), options);
}

Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options& options) {
  TrackStudy study(train, test == nullptr ? std::nullopt : std::optional(*test), {}, options);
  return identified_by(study, options);
}

}  // namespace kilotwin::identify

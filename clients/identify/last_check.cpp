#include "clients/identify/last_check.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "clients/identify/predict/final_check.hpp"

namespace kilotwin::identify {
namespace {

/// A term that lowers the error by this share stays, whatever the sign of an uncertain gain in likelihood. A term of the measurement
/// that raises the error by this share goes, whatever its gain.
constexpr double kClearError = 0.02;

bool on_measurement(const Term& term) { return is_measured(term.blocks.front().target); }

void take_out(Search& found, std::size_t t, FitState without) {
  found.fit = std::move(without);
  found.reasons.erase(found.reasons.begin() + static_cast<std::ptrdiff_t>(t));
}

/// The models on the way of the search with fewer terms than its result, the result with maps in place of circles, and the result.
std::vector<Stage> path_to(const Search& found) {
  std::vector<Stage> path;
  const std::size_t terms = found.fit.model.terms.size();
  std::copy_if(found.path.begin(), found.path.end(), std::back_inserter(path),
               [&](const Stage& stage) { return stage.fit.model.terms.size() < terms; });
  if (terms == 0) path.push_back(found.path.front());
  if (terms == 0 && found.fit.model.base.command_lag_s == path.front().fit.model.base.command_lag_s) return path;
  if (found.with_curves) path.push_back(*found.with_curves);
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

/// The error of models on the tracks that choose: each forecast counts by the variance that the base model expects of it. Otherwise a
/// few, made before the heading is known or in a crowd, would decide by chance.
class Yardstick {
 public:
  Yardstick(const Evaluation& choosing, const Judged& base) : set_(choosing.set()), rows_(base.errors.rows) {
    for (const Forecast& p : base.forecasts) {
      const double expected_mm2 = p.expected_error_mm * p.expected_error_mm;
      weights_.push_back(expected_mm2 > 0 && std::isfinite(expected_mm2) ? 1 / expected_mm2 : 0);
    }
  }
  /// Infinite if the model fails to predict rows that the base model predicts.
  [[nodiscard]] double error_mm(const Judged& judged) const {
    if (judged.errors.rows != rows_ || judged.forecasts.size() != weights_.size()) return INFINITY;
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const Forecast& p = judged.forecasts[i];
      const std::optional<Eigen::Vector2d> error = error_of(set_.runs[p.run].tracks[p.place], p);
      if (!error) continue;
      sum += weights_[i] * error->squaredNorm();
      all += weights_[i];
    }
    return all > 0 ? std::sqrt(sum / all) : judged.errors.rmse_mm();
  }

 private:
  const MeasuredSet& set_;
  std::size_t rows_;
  std::vector<double> weights_;
};

/// Everything about dropped effects leaves the findings, except that they were dropped.
void note_dropped(Findings& f, const Stage& last) {
  const std::vector<std::string> kept = effects_of(f.found.fit.model);
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

/// The model without one term, on the tracks that choose.
struct Trial {
  FitState without;
  Judged judged;     ///< of the model without it
  HeldOutGain gain;  ///< of the model with the term over the one without
  bool useless;
};

Trial trial_of(const Fitter& fitter, const FitState& fit, std::size_t t, const Evaluation& choosing,
               const Yardstick& yardstick, const ForecastTimes& times, const Judged& with) {
  FitState without = without_term(fitter, fit, t);
  const double with_mm = yardstick.error_mm(with);
  Judged judged = choosing.judge(without, times);
  const double without_mm = yardstick.error_mm(judged);
  const HeldOutGain gain = held_out_gain(fit.model, without.model, with.tracks, choosing.of(), fitter.threads());
  // Effects of the measurement hardly change predicted positions. They must not raise the error; if their gain is beyond chance, not
  // clearly.
  const double may_rise = gain.nat > 2 * gain.nat_se ? kClearError : kSameError;
  const double least_mm = with_mm * (on_measurement(fit.model.terms[t]) ? 1 - may_rise : 1 + kSameError);
  // A likelihood of few tracks has a large error of its own. Negated, so that a gain that is no number does not pass.
  const bool is_unlikely =
      !(gain.nat + 2 * gain.nat_se >= 0) || (gain.nat < 0 && !(without_mm > with_mm * (1 + kClearError)));
  return {std::move(without), std::move(judged), gain, is_unlikely || without_mm <= least_mm};
}

/// Takes out terms one at a time: of those that do not help the one with the least gain. `with`: the model, judged. Returns what is
/// left, judged.
Judged without_useless(Findings& f, const Fitter& fitter, const Evaluation& choosing, const Yardstick& yardstick,
                       const ForecastTimes& times, Judged with) {
  for (;;) {
    f.check.gains.clear();
    std::optional<Trial> worst;
    std::size_t place = 0;
    for (std::size_t t = 0; t < f.found.fit.model.terms.size(); ++t) {
      Trial trial = trial_of(fitter, f.found.fit, t, choosing, yardstick, times, with);
      f.check.gains.push_back(trial.gain);
      if (!trial.useless || (worst && !(trial.gain.nat < worst->gain.nat))) continue;
      worst = std::move(trial);
      place = t;
    }
    if (!worst) return with;
    take_out(f.found, place, std::move(worst->without));
    with = std::move(worst->judged);
  }
}

}  // namespace

FitState without_term(const Fitter& fitter, const FitState& fit, std::size_t term) {
  FitState less = fit;
  less.model.terms.erase(less.model.terms.begin() + static_cast<std::ptrdiff_t>(term));
  // The base speeds may have to make up for a large part of the term.
  fitter.fit_until_settled(less);
  return less;
}

void keep_predictive_terms(const Fitter& fitter, const MeasuredSet& train, const ForecastTimes& times,
                           Search& found) {
  const auto error_mm = [&](const FitState& state) {
    return errors_of(train, forecast(state.model, state.tracks, times, Tracks::kFit, fitter.threads())).rmse_mm();
  };
  if (found.fit.model.terms.empty()) return;
  double with_mm = error_mm(found.fit);
  for (std::size_t t = found.fit.model.terms.size(); t-- > 0;) {
    FitState without = without_term(fitter, found.fit, t);
    const double without_mm = error_mm(without);
    // Measurement effects need not reduce the error. They must not raise it.
    if (without_mm > with_mm * (on_measurement(found.fit.model.terms[t]) ? 0.9995 : 1.0005)) continue;
    take_out(found, t, std::move(without));
    with_mm = without_mm;
  }
}

void choose_on_held_out(Findings& f, const Fitter& fitter, const Evaluation& choosing, const ForecastTimes& times) {
  const std::vector<Stage> path = path_to(f.found);
  std::vector<Judged> judged;
  std::vector<Candidate> candidates;
  std::optional<Yardstick> yardstick;
  for (const Stage& stage : path) {
    judged.push_back(choosing.judge(stage.fit, times));
    if (!yardstick) yardstick.emplace(choosing, judged.front());
    const std::vector<Term>& terms = stage.fit.model.terms;
    const auto moving = std::count_if(terms.begin(), terms.end(), [](const Term& t) { return !on_measurement(t); });
    candidates.push_back({static_cast<std::size_t>(moving), yardstick->error_mm(judged.back())});
    f.check.path.push_back({effects_of(stage.fit.model), candidates.back().rmse_mm});
  }
  f.check.kept = smallest_of_the_best(candidates);
  f.found.fit = path[f.check.kept].fit;
  f.found.reasons = path[f.check.kept].reasons;
  const Judged left_over = without_useless(f, fitter, choosing, *yardstick, times, std::move(judged[f.check.kept]));
  const MotionModel &left = f.found.fit.model, &base = path.front().fit.model;
  const bool is_base = left.terms.empty() && left.base.command_lag_s == base.base.command_lag_s;
  // Negated, so that an error that is no number does not pass.
  if (is_base || !(yardstick->error_mm(left_over) <= candidates.front().rmse_mm * (1 + kSameError))) {
    f.found.fit = path.front().fit;
    f.found.reasons.clear();
    f.check.gains.clear();
    f.check.kept = 0;
  }
  note_dropped(f, path.back());
}

void keep_base_model(Findings& f) {
  const Stage last{f.found.fit, f.found.reasons};
  f.found.fit = f.base;
  f.found.reasons.clear();
  f.check.gains.clear();
  f.check.kept = 0;
  note_dropped(f, last);
}

}  // namespace kilotwin::identify

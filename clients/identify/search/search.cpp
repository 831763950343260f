#include "clients/identify/search/search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "clients/identify/search/amplitudes.hpp"
#include "clients/identify/search/calibration_shifts.hpp"
#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/search_loop.hpp"
#include "clients/identify/search/simplification.hpp"

namespace kilotwin::identify {
namespace {

/// Limits of a search: hypotheses that failed after their refit, and work (PreparedSet::work). A set of 24 robots, 3 runs and 300 s
/// stays far below the last one.
constexpr int kMostFailed = 20;
constexpr std::uint64_t kMostWork = 3'000'000'000;

}  // namespace

SearchLoop::SearchLoop(const Fitter& fitter, const FitState& base, const WorkLog& log,
                       const std::function<bool(const FitState&)>& leaves_much)
    : fitter_(fitter),
      log_(log),
      leaves_much_(leaves_much),
      extent_(extent_of(base.tracks)),
      worked_before_(base.tracks.work()),
      out_{base, {}, {{base, {}}}, {}, {}, {}, {}} {
  base_likelihood_ = fitter.log_likelihood_of_all(base);
}

Search SearchLoop::run() {
  while (changed()) {
    ++round_;
    exchange_clocks();
    note_stage();
  }
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
    simplify(fitter_, out_.fit, t);
    if (!is_constant_drift(out_.fit.model.terms[t])) continue;
    out_.note_renamed(std::exchange(out_.fit.model.terms[t].name, "drift"), "drift");
    out_.reasons[t].covariates = {"world_frame"};
  }
  out_.work = out_.fit.tracks.work();
  return std::move(out_);
}

bool SearchLoop::changed() {
  if (limit().empty() && accept_calibration_shifts()) return true;
  if (has_parts_of_circle() && accept_moving_circle(true)) return true;
  if (accept_hypothesis(Tail::kOfColumns)) return true;
  say(kAlternatives, "testing alternatives");
  return eliminate() || accept_moving_circle(false) || accept_further_circle() ||
         accept_general(Tail::kOfColumns) || accept_hypothesis(Tail::kOfClusters) ||
         accept_general(Tail::kOfClusters);
}

bool SearchLoop::accept_hypothesis(Tail tail) {
  if (tail == Tail::kOfClusters && !limit().empty()) return false;
  say(kTest, "testing hypotheses");
  score_dictionary(tail);
  const ScoreTest::Outcome outcome = score_test_->test(kSeed + static_cast<std::uint64_t>(round_), tail);
  if (tail == Tail::kOfColumns) note_rejected(outcome);
  // A hypothesis that fails leaves the state as it was, so that the outcome of the tests remains valid.
  bool waves_tried = false;
  while (const Finding* const best = best_of(outcome, kRemnant * explained(), tail)) {
    out_.limit = limit();
    if (!out_.limit.empty()) return false;
    if (lag_explains(*best)) return true;
    if (!std::exchange(waves_tried, true) && accept_wave(best->evidence)) return true;
    if (accepted(*best, outcome, tail)) return true;
    ++failures_;
  }
  return false;
}

bool SearchLoop::worked_out() const { return out_.fit.tracks.work() - worked_before_ >= kMostWork; }

std::string SearchLoop::limit() const {
  if (worked_out()) return "The search ended at its limit of work; further effects may be in these data.";
  if (failures_ >= kMostFailed)
    return fmt::format(
        "The search ended after {} hypotheses that passed the tests but did not fit; further effects may be in "
        "these data.",
        failures_);
  if (round_ >= kMostRounds + 2 * general_terms_)
    return fmt::format(
        "The search ended at its limit of {} changes of the model, with a further effect significant.", round_);
  return {};
}

bool SearchLoop::accepted(const Finding& best, const ScoreTest::Outcome& outcome, Tail tail) {
  const Search before = out_;
  const std::string name = hypothesis(best).name;
  say(kAddition, "fitting " + name);
  const Likelihoods likelihoods = likelihoods_now();
  note_ambiguous(best, outcome);
  if (replaced_by_alternative(name)) return true;
  Alternatives had = std::exchange(alternatives_, {});
  note_alternatives(best, outcome);
  const Finding* const other = other_form(best, outcome);
  const std::optional<Search> unchanged = other != nullptr ? std::optional(out_) : std::nullopt;
  add(best, outcome.threshold_log10_p);
  if (unchanged) {
    Search first = std::exchange(out_, *unchanged);
    add(*other, outcome.threshold_log10_p);
    if (!(fitter_.log_evidence(out_.fit) > fitter_.log_evidence(first.fit))) out_ = std::move(first);
  }
  if (!rose_from(likelihoods, tail)) {
    out_ = before;
    alternatives_ = std::move(had);
    failed_.insert({Attempt::Kind::kNamed, {name}, tail});
    return false;
  }
  // A finding may have refined an earlier term instead.
  if (out_.fit.model.terms.size() > before.fit.model.terms.size()) separate_last();
  eliminate_earlier();
  fitter_.fit_contacts(out_.fit);
  try_camera_motion();
  refit_lag();
  return true;
}

SearchLoop::Likelihoods SearchLoop::likelihoods_now() const {
  return {fitter_.log_likelihood(out_.fit), fitter_.log_likelihood_of_all(out_.fit)};
}

bool SearchLoop::rose_from(const Likelihoods& before, Tail tail) const {
  const Likelihoods now = likelihoods_now();
  return now.of_all >= before.of_all + kLeastRise ||
         (tail == Tail::kOfClusters && now.away >= before.away + kLeastRise);
}

void SearchLoop::refit_lag() {
  if (out_.fit.model.base.command_lag_s == 0 || became_punctual() || fitter_.fit_command_lag(out_.fit) == 0) return;
  for (std::size_t t = out_.fit.model.terms.size(); t-- > 0;) removed(t, false);
}

bool SearchLoop::became_punctual() {
  // Passes without the lag, since all parameters have followed it; fewer judge it before the fit has settled.
  constexpr int kPasses = 4;
  const Search before = out_;
  const double evidence = fitter_.log_evidence(out_.fit);
  out_.fit.model.base.command_lag_s = 0;
  out_.fit.tracks.set_command_lag(0);
  fitter_.fit(out_.fit, kPasses);
  // The term that was added or refined last.
  std::size_t place = out_.fit.model.terms.size() - 1;
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t)
    if (out_.fit.model.terms[t].name == out_.steps.back().added) place = t;
  refine_shape(place);
  if (fitter_.log_evidence(out_.fit) > evidence - kClose) return true;
  out_ = before;
  return false;
}

void SearchLoop::say(WorkKind kind, std::string activity) const {
  const std::vector<Term>& terms = out_.fit.model.terms;
  for (const Term& term : terms) activity += (&term == &terms.front() ? "; accepted: " : ", ") + term.name;
  const int adds = kind == kAddition ? 1 : 0;
  log_.begin(kind, fmt::format("search, round {}", round_ + 1), activity,
             terms.size() + static_cast<std::size_t>(adds),
             limit().empty() ? std::max(0, kMostRounds + 2 * general_terms_ - round_ - adds) : 0);
}

bool SearchLoop::lag_explains(const Finding& best) {
  // Share of the best hypothesis's evidence that a lag must gain to be taken in its place. A larger value leaves a wrong
  // clock to effects; a smaller one takes effects for a clock.
  constexpr double kMost = 0.8;
  if (fitter_.fit_command_lag(out_.fit, kMost * best.evidence) == 0) return false;
  // Effects that were found beside a wrong clock may be its artefacts: the search starts anew.
  if (!out_.reasons.empty() && !starts_anew_) {
    FitState anew = out_.path.front().fit;
    if (fitter_.fit_command_lag(anew) == 0) return true;
    starts_anew_ = true;
    out_ = {std::move(anew), {}, {out_.path.front()}, {}, {}, {}, {}};
    failed_.clear();
    alternatives_ = {};
    round_ = failures_ = eliminations_ = general_terms_ = 0;
  }
  // The gain of a lag is none of effects.
  if (out_.reasons.empty()) base_likelihood_ = fitter_.log_likelihood_of_all(out_.fit);
  return true;
}

bool SearchLoop::accept_calibration_shifts() {
  // A smooth curve of a drift with sudden ends leaves residuals that look like shifts.
  if (std::any_of(out_.fit.model.terms.begin(), out_.fit.model.terms.end(), is_drift_over_time)) return false;
  const std::vector<CalibrationShift> shifts = add_calibration_shifts(fitter_, out_.fit, kRemnant * explained());
  if (shifts.empty()) return false;
  fitter_.fit_contacts(out_.fit);
  Finding finding;
  bool pushed = true;
  for (const CalibrationShift& shift : shifts) {
    finding.evidence += shift.gain;
    finding.degrees += CalibrationShift::kNumbers;
    // p of half chi squared with four degrees of freedom, over some thousand instants.
    constexpr double kInstants = 5000;
    finding.log10_p =
        std::min(finding.log10_p, (std::log1p(shift.gain) - shift.gain + std::log(kInstants)) / std::log(10.0));
    pushed = pushed && std::abs(shift.gain - shift.gain_as_push) < kClose;
  }
  const std::vector<std::string> covariates{"measurement", "time"}, world{"world_frame", "time"};
  out_.reasons.push_back({covariates, "measured position", finding, std::log10(ScoreTest::kFamilyAlarm)});
  if (pushed) out_.ambiguous.push_back({kCalibrationShiftsName, effect_name(kWorld, "time"), covariates, world, 0});
  out_.steps.push_back({kCalibrationShiftsName, finding.evidence});
  return true;
}

void SearchLoop::add(const Finding& found, double threshold) {
  const Hypothesis& h = hypothesis(found);
  Term term = dictionary_.term_of(h, found.relative_scale);
  const Reason reason{h.covariates, h.acts_on, found, threshold};
  // A further term of an accepted effect may belong to a richer shape of it.
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
    if (out_.fit.model.terms[t].name != h.name) continue;
    if (recovered_by_refinement(t, found.evidence)) {
      out_.steps.push_back({h.name, found.held_out});
      return;
    }
    const Finding instead = score_test_->evidence_of(h, static_cast<int>(t));
    const Finding own = score_test_->evidence_of_term(static_cast<int>(t));
    if (instead.evidence < own.evidence + found.evidence - 2) continue;
    out_.fit.model.terms[t] = dictionary_.term_of(h, instead.relative_scale);
    out_.reasons[t].finding = instead;
    out_.reasons[t].finding.log10_p = std::min(reason.finding.log10_p, out_.reasons[t].finding.log10_p);
    fitter_.fit(out_.fit, 2);
    refine_shape(t);
    out_.steps.push_back({out_.fit.model.terms[t].name, found.held_out});
    return;
  }
  out_.fit.model.terms.push_back(std::move(term));
  out_.reasons.push_back(reason);
  fitter_.fit(out_.fit, 2);
  out_.steps.push_back({h.name, found.held_out});
  if (!merged()) refine_shape(out_.fit.model.terms.size() - 1);
}

bool SearchLoop::recovered_by_refinement(std::size_t place, double expected_gain) {
  // Share of the expected gain that a refined shape must reach, so that no new term is needed. A smaller value merges
  // effects that are two; a larger one adds terms that a shape could have shown.
  constexpr double kMost = 0.5;
  const Search before = out_;
  const double likelihood = fitter_.log_likelihood(out_.fit);
  refine_shape(place);
  if (fitter_.log_likelihood(out_.fit) > likelihood + kMost * expected_gain) return true;
  out_ = before;
  return false;
}

bool SearchLoop::merged() {
  const std::optional<std::size_t> curve = merge_amplitudes(fitter_, out_.fit);
  if (!curve) return false;
  const Reason& of_curve = out_.reasons[*curve];
  Reason& of_both = out_.reasons.back();
  of_both.finding.evidence += of_curve.finding.evidence;
  of_both.finding.log10_p = std::min(of_both.finding.log10_p, of_curve.finding.log10_p);
  of_both.threshold_log10_p = of_curve.threshold_log10_p;
  out_.reasons.erase(out_.reasons.begin() + static_cast<std::ptrdiff_t>(*curve));
  return true;
}

Search search(const Fitter& fitter, const FitState& base, const WorkLog& log,
              const std::function<bool(const FitState&)>& leaves_much) {
  return SearchLoop(fitter, base, log, leaves_much).run();
}

}  // namespace kilotwin::identify

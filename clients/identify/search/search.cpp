#include "clients/identify/search/search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "clients/identify/search/amplitudes.hpp"
#include "clients/identify/search/calibration_shifts.hpp"
#include "clients/identify/search/central_distortion.hpp"
#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/neighbour_shape.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/target_extension.hpp"
#include "clients/identify/search/total_variation_map.hpp"
#include "clients/identify/search/traffic_shape.hpp"
#include "clients/identify/search/travelling_waves.hpp"
#include "clients/identify/search/wheel_offsets.hpp"

namespace kilotwin::identify {
namespace {

/// Limits of a search: hypotheses that failed after their refit, general terms, and work (PreparedSet::work). A set of
/// 24 robots, 3 runs and 300 s stays far below the last one.
constexpr int kMostFailed = 20, kMostGeneral = 3;
constexpr std::uint64_t kMostWork = 3'000'000'000;
/// Hypotheses with more alternatives (as a logarithm) than this, single steps and pulses, are no alternatives in
/// an exchange.
constexpr double kManyChoices = 2.5;
constexpr std::uint64_t kSeed = 20180729;
/// Effects with log evidence closer than this (a Bayes factor of 20) count as ambiguous.
constexpr double kClose = 3;
/// Largest loss of log likelihood in an exchange: with few columns, and with the refined shape.
constexpr double kMostByShape = 200, kAsGood = 10;
/// Hypotheses with this share of the best evidence are kept as alternatives: the order may change after shape
/// refinement.
constexpr double kAlternativeShare = 0.97;
/// No form is exact. A hypothesis that explains less than this share of the total gain counts as a remnant.
constexpr double kRemnant = 0.003;
/// Largest number of samples in the test. More add cost and no power that is needed.
constexpr std::size_t kEnoughSamples = 130000;
/// The same for general terms, which have more columns.
constexpr std::size_t kEnoughForGeneral = 70000;
/// The same where the error that is left looks like noise: enough for a clear effect. Such an effect must pass these
/// bounds, with a p so much below the threshold, because the error itself gives no reason to look for one.
constexpr std::size_t kEnoughForScreening = 25000;
constexpr double kClearEvidence = 15, kClearLog10P = 2, kClearHeldOut = 8;
/// General terms that are tried in one round.
constexpr std::size_t kMostTries = 4;
/// An attempt of the search. One that failed is not repeated.
struct Attempt {
  enum class Kind : std::uint8_t {
    kNamed,       ///< a hypothesis with a named form
    kForm,        ///< a wave or a moving circle, which may have the name of a general term
    kGeneral,     ///< a general term
    kWave,        ///< a wave among named hypotheses
    kLoneCircle,  ///< a moving circle in place of terms, if it leaves no hypothesis
    kCircle,      ///< a moving circle in place of terms
    kExchange     ///< the first hypothesis in place of a term, the second
  };
  Kind kind;
  std::vector<std::string> names;
  auto operator<=>(const Attempt&) const = default;
};

class Loop {
 public:
  Loop(const Fitter& fitter, const FitState& base, const WorkLog& log,
       const std::function<bool(const FitState&)>& leaves_much)
      : fitter_(fitter),
        log_(log),
        leaves_much_(leaves_much),
        extent_(extent_of(base.tracks)),
        out_{base, {}, {{base, {}}}, {}, {}, {}, {}} {
    base_likelihood_ = fitter.log_likelihood_of_all(base);
  }

  Search run() {
    while (changed()) {
      ++round_;
      note_stage();
    }
    for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
      simplify(fitter_, out_.fit, t);
      if (!is_constant_drift(out_.fit.model.terms[t])) continue;
      note_renamed(std::exchange(out_.fit.model.terms[t].name, "drift"), "drift");
      out_.reasons[t].covariates = {"world_frame"};
    }
    out_.work = out_.fit.tracks.work();
    return std::move(out_);
  }

 private:
  /// Makes one change of the model: an addition, or at a limit and when nothing passes a removal or an exchange.
  /// Returns false if there is none.
  bool changed() {
    say(kTest, "testing hypotheses");
    if (limit().empty() && accept_calibration_shifts()) return true;
    if (has_parts_of_circle() && accept_moving_circle(true)) return true;
    score_dictionary();
    const ScoreTest::Outcome outcome = score_test_->test(kSeed + static_cast<std::uint64_t>(round_));
    note_rejected(outcome);
    // A hypothesis that fails leaves the state as it was, so that the outcome of the tests remains valid.
    bool waves_tried = false;
    while (const Finding* const best = best_of(outcome, kRemnant * explained())) {
      out_.limit = limit();
      if (!out_.limit.empty()) break;
      if (lag_explains(*best)) return true;
      if (!std::exchange(waves_tried, true) && accept_wave(best->evidence)) return true;
      if (accepted(*best, outcome, outcome.threshold_log10_p)) return true;
      ++failures_;
    }
    say(kAlternatives, "testing alternatives");
    return eliminate() || accept_moving_circle(false) || accept_further_circle() || accept_general();
  }
  /// The limit that the search has reached, in one sentence; empty: none. It then adds nothing more.
  [[nodiscard]] std::string limit() const {
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
  [[nodiscard]] bool worked_out() const { return out_.fit.tracks.work() >= kMostWork; }
  /// Adds a hypothesis whose p fell below `threshold_log10_p`. Returns false, with the state as before, if the likelihood
  /// does not rise by a part of the predicted gain.
  bool accepted(const Finding& best, const ScoreTest::Outcome& outcome, double threshold_log10_p) {
    constexpr double kLeastRise = 3;
    const Search before = out_;
    const std::string name = hypothesis(best).name;
    say(kAddition, "fitting " + name);
    const double likelihood = fitter_.log_likelihood_of_all(out_.fit);
    note_ambiguous(best, outcome);
    if (replaced_by_alternative(name)) return true;
    note_alternatives(best, outcome);
    add(best, threshold_log10_p);
    // Negated, so that a likelihood that is no number fails.
    if (!(fitter_.log_likelihood_of_all(out_.fit) >= likelihood + kLeastRise)) {
      out_ = before;
      failed_.insert({Attempt::Kind::kNamed, {name}});
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
  /// A lag that was fitted before a term may have been off: refits it, and takes out what it explains then.
  void refit_lag() {
    if (out_.fit.model.base.command_lag_s == 0 || became_punctual() || fitter_.fit_command_lag(out_.fit) == 0)
      return;
    for (std::size_t t = out_.fit.model.terms.size(); t-- > 0;) removed(t, false);
  }
  /// A term may be what looked like a lag, as speed does that builds up after a command: it may then explain more without one, and
  /// the small steps of a refit don't reach lag 0. Returns whether the model has no lag now.
  bool became_punctual() {
    constexpr int kPasses = 4;
    const Search before = out_;
    const double evidence = fitter_.log_evidence(out_.fit);
    out_.fit.model.base.command_lag_s = 0;
    out_.fit.tracks.set_command_lag(0);
    fitter_.fit(out_.fit, kPasses);
    refine_shape(out_.fit.model.terms.size() - 1);
    if (fitter_.log_evidence(out_.fit) > evidence - kClose) return true;
    out_ = before;
    return false;
  }
  void note_stage() { out_.path.push_back({out_.fit, out_.reasons}); }
  void say(WorkKind kind, std::string activity) const {
    const std::vector<Term>& terms = out_.fit.model.terms;
    for (const Term& term : terms) activity += (&term == &terms.front() ? "; accepted: " : ", ") + term.name;
    const int adds = kind == kAddition ? 1 : 0;
    log_.begin(kind, fmt::format("search, round {}", round_ + 1), activity,
               terms.size() + static_cast<std::size_t>(adds),
               limit().empty() ? std::max(0, kMostRounds + 2 * general_terms_ - round_ - adds) : 0);
  }
  /// The tracks of the test. A large set: every n-th unit.
  [[nodiscard]] std::vector<std::vector<const TrackView*>> tested_units(
      std::size_t most_samples = kEnoughSamples) const {
    std::vector<std::vector<const TrackView*>> units = out_.fit.tracks.units();
    std::size_t samples = 0;
    for (const auto& unit : units)
      for (const TrackView* view : unit) samples += view->track->samples.size();
    const std::size_t every = samples / most_samples + 1;
    std::vector<std::vector<const TrackView*>> part;
    for (std::size_t u = 0; u < units.size(); u += every) part.push_back(units[u]);
    return part.size() >= 6 ? part : units;
  }
  void score_dictionary() {
    dictionary_ = dictionary_of(extent_, out_.fit.model.terms);
    std::vector<Block> blocks = blocks_of(out_.fit.model);
    blocks.insert(blocks.end(), dictionary_.blocks.begin(), dictionary_.blocks.end());
    const ColumnGroups read = columns_read_by_test(out_.fit.model, dictionary_);
    const std::vector<Unit> units =
        linearise(out_.fit.model, tested_units(), blocks, {100, fitter_.threads(), -1, &read});
    score_test_.emplace(fitter_, out_.fit.model, units, dictionary_);
  }
  const Finding* best_of(const ScoreTest::Outcome& outcome, double least_evidence) const {
    const Finding* best = nullptr;
    for (const Finding& f : outcome.findings) {
      if (!good(f, outcome.threshold_log10_p) || f.evidence < least_evidence ||
          failed_.contains({Attempt::Kind::kNamed, {hypothesis(f).name}}))
        continue;
      if (of_robots_and_more(hypothesis(f)) && parts_evidence(hypothesis(f), outcome) > f.evidence) continue;
      if (best == nullptr || f.evidence > best->evidence) best = &f;
    }
    return best;
  }
  static bool of_robots_and_more(const Hypothesis& h) {
    return h.covariates.size() == 2 &&
           std::find(h.covariates.begin(), h.covariates.end(), "robot") != h.covariates.end();
  }
  /// Evidence of the two single effects (of robots, and of the other covariate) if either is significant: the
  /// alternative to their combination.
  double parts_evidence(const Hypothesis& pair, const ScoreTest::Outcome& outcome) const {
    double sum = 0;
    bool any = false;
    for (const std::string& part : pair.covariates) {
      double most = 0;
      for (const Finding& f : outcome.findings) {
        const Hypothesis& h = hypothesis(f);
        if (h.acts_on != pair.acts_on || h.covariates != std::vector<std::string>{part}) continue;
        any = any || (good(f, outcome.threshold_log10_p) && !failed_.contains({Attempt::Kind::kNamed, {h.name}}));
        most = std::max({most, f.evidence, (f.statistic - f.degrees) / 2});
      }
      sum += most;
    }
    return any ? sum : 0;
  }
  static bool good(const Finding& f, double threshold) {
    return f.log10_p < threshold && f.evidence > 3 && f.held_out > 2;
  }
  static bool clear(const Finding& f, double threshold) {
    return f.log10_p < threshold - kClearLog10P && f.evidence > kClearEvidence && f.held_out > kClearHeldOut;
  }
  const Hypothesis& hypothesis(const Finding& f) const { return dictionary_.hypotheses[f.hypothesis]; }

  /// Gain in log likelihood of all accepted effects.
  [[nodiscard]] double explained() const { return fitter_.log_likelihood_of_all(out_.fit) - base_likelihood_; }

  /// A general term that passed, with its reason.
  struct GeneralTerm {
    Term term;
    Reason reason;
  };
  using Candidates = std::map<Attempt, GeneralTerm>;
  /// Adds the hypotheses of a family that pass the tests, of each name the one with the most evidence, by kind and name. `screening`:
  /// only clear ones.
  void add_candidates(const Dictionary& family, bool general, double least_evidence, Candidates& best,
                      bool screening = false) {
    std::vector<Block> blocks = blocks_of(out_.fit.model);
    blocks.insert(blocks.end(), family.blocks.begin(), family.blocks.end());
    const ColumnGroups read = columns_read_by_test(out_.fit.model, family);
    const std::vector<Unit> units =
        linearise(out_.fit.model, tested_units(screening ? kEnoughForScreening : kEnoughForGeneral), blocks,
                  {100, fitter_.threads(), -1, &read});
    const ScoreTest test(fitter_, out_.fit.model, units, family);
    const ScoreTest::Outcome outcome = test.test(kSeed + 100 + static_cast<std::uint64_t>(round_));
    for (const Finding& f : outcome.findings) {
      const Hypothesis& h = family.hypotheses[f.hypothesis];
      const Attempt attempt{general ? Attempt::Kind::kGeneral : Attempt::Kind::kForm, {h.name}};
      const auto known = best.find(attempt);
      if (!(screening ? clear(f, outcome.threshold_log10_p) : good(f, outcome.threshold_log10_p)) ||
          f.evidence < least_evidence || failed_.contains(attempt) ||
          (known != best.end() && f.evidence <= known->second.reason.finding.evidence))
        continue;
      GeneralTerm one{family.term_of(h, f.relative_scale), {h.covariates, h.acts_on, f, outcome.threshold_log10_p}};
      one.term.general = general;
      best.insert_or_assign(attempt, std::move(one));
    }
  }
  /// Those of all families, in the order of their evidence. `screening`: only clear ones.
  std::vector<GeneralTerm> general_candidates(bool screening) {
    if (general_.empty()) general_ = general_dictionaries_of(extent_);
    std::vector<Dictionary> families = general_;
    if (!screening) {
      if (Dictionary waves = wave_dictionary_of(fitter_, out_.fit, extent_); !waves.hypotheses.empty())
        families.push_back(std::move(waves));
      const std::vector<MovingCircle> circles = moving_circles_of(fitter_, out_.fit, extent_);
      if (!circles.empty()) families.push_back(dictionary_of_circles(out_.fit, extent_, circles));
    }
    Candidates best;
    const double least = kRemnant * explained();
    for (const Dictionary& family : families) {
      // Waves and moving circles have a form of their own, with a name.
      const bool general = static_cast<std::size_t>(&family - families.data()) < general_.size();
      add_candidates(family, general, least, best, screening);
    }
    std::vector<GeneralTerm> ranked;
    for (auto& [attempt, one] : best) ranked.push_back(std::move(one));
    std::stable_sort(ranked.begin(), ranked.end(), [](const GeneralTerm& a, const GeneralTerm& b) {
      return a.reason.finding.evidence > b.reason.finding.evidence;
    });
    if (ranked.size() > kMostTries) ranked.resize(kMostTries);
    return ranked;
  }
  /// Adds a term. Returns false, with the state as before, if the likelihood does not rise. `attempt`: noted as
  /// failed.
  bool fits(GeneralTerm one, const Attempt& attempt) {
    constexpr double kLeastRise = 3;
    const Search before = out_;
    const double likelihood = fitter_.log_likelihood_of_all(out_.fit);
    out_.steps.push_back({one.term.name, one.reason.finding.held_out});
    out_.fit.model.terms.push_back(std::move(one.term));
    out_.reasons.push_back(std::move(one.reason));
    fitter_.fit(out_.fit, 2);
    refine_shape(out_.fit.model.terms.size() - 1);
    fitter_.fit_contacts(out_.fit);
    if (fitter_.log_likelihood_of_all(out_.fit) >= likelihood + kLeastRise) return true;
    out_ = before;
    failed_.insert(attempt);
    return false;
  }
  /// A travelling wave with more evidence than the best hypothesis, which may be a proxy of it: adds the wave. A wave that
  /// repeats neither within a run nor on the floor is left to the other hypotheses: it may be a proxy itself.
  bool accept_wave(double evidence) {
    constexpr double kFewestPeriods = 1.5, kFewestStripes = 4;
    const Attempt attempt{Attempt::Kind::kWave, {}};
    if (failed_.contains(attempt)) return false;
    const Dictionary waves = wave_dictionary_of(fitter_, out_.fit, extent_);
    if (waves.hypotheses.empty()) return false;
    Candidates best;
    add_candidates(waves, false, evidence, best);
    if (best.empty()) return false;
    GeneralTerm& wave = best.begin()->second;
    const std::vector<double>& numbers = wave.term.blocks.front().basis.factors.front().points;
    const double periods = std::abs(numbers[2]) * extent_.duration_s / (2 * M_PI),
                 stripes = (std::abs(numbers[0]) * (extent_.x_high_mm - extent_.x_low_mm) +
                            std::abs(numbers[1]) * (extent_.y_high_mm - extent_.y_low_mm)) /
                           (2 * M_PI);
    if (periods < kFewestPeriods && stripes < kFewestStripes) return false;
    say(kAddition, "fitting " + wave.term.name);
    return fits(std::move(wave), attempt);
  }
  /// Whether a term is an effect of position or time on the speed, and no moving circle itself.
  [[nodiscard]] bool may_be_part_of_circle(std::size_t t) const {
    const Reason& reason = out_.reasons[t];
    return reason.acts_on == kSpeed.in_words && !is_moving_circle(out_.fit.model.terms[t]) &&
           std::all_of(reason.covariates.begin(), reason.covariates.end(),
                       [](const std::string& of) { return of == "position" || of == "time"; });
  }
  /// Whether effects of both position and time were found that a moving circle may replace. Its further proxies would cost many
  /// rounds.
  [[nodiscard]] bool has_parts_of_circle() const {
    std::set<std::string> of;
    for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t)
      if (may_be_part_of_circle(t)) of.insert(out_.reasons[t].covariates.begin(), out_.reasons[t].covariates.end());
    return of.size() == 2;
  }
  /// Whether a hypothesis beside the model passes the tests and explains a fair share of what its terms explain.
  bool leaves_hypothesis() {
    constexpr double kFair = 0.02;
    score_dictionary();
    const ScoreTest::Outcome outcome = score_test_->test(kSeed + static_cast<std::uint64_t>(round_));
    return best_of(outcome, kFair * explained()) != nullptr;
  }
  /// Effects of position and of time can be proxies of a circle that moves or grows: tries one in place of all of them. It stays
  /// if the evidence of the whole model is larger. `alone`: and if no hypothesis finds much beside it. Otherwise the effects may grow
  /// into a product that explains more.
  bool accept_moving_circle(bool alone) {
    // One amplitude within a circle explains less than its curve: the share of what the other terms explain that is worth a fit.
    // A product that comes later may explain what the circle leaves, unless it leaves nothing.
    const double least_share = alone ? 0.2 : 0.5;
    Attempt attempt{alone ? Attempt::Kind::kLoneCircle : Attempt::Kind::kCircle, {}};
    for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t)
      if (may_be_part_of_circle(t)) attempt.names.push_back(out_.fit.model.terms[t].name);
    if (attempt.names.empty() || worked_out() || !failed_.insert(attempt).second) return false;
    say(kAlternatives, "testing moving circles");
    const Search before = out_;
    const double evidence = fitter_.log_evidence(out_.fit), likelihood = fitter_.log_likelihood_of_all(out_.fit);
    for (std::size_t t = out_.fit.model.terms.size(); t-- > 0;) {
      if (!may_be_part_of_circle(t)) continue;
      out_.fit.model.terms.erase(out_.fit.model.terms.begin() + static_cast<std::ptrdiff_t>(t));
      out_.reasons.erase(out_.reasons.begin() + static_cast<std::ptrdiff_t>(t));
    }
    fitter_.fit(out_.fit, 2);
    const double explained = likelihood - fitter_.log_likelihood_of_all(out_.fit);
    const std::vector<MovingCircle> circles = moving_circles_of(fitter_, out_.fit, extent_);
    if (!circles.empty() && circles.front().gain > least_share * explained) {
      Candidates best;
      add_candidates(dictionary_of_circles(out_.fit, extent_, circles), false, least_share * explained, best);
      if (!best.empty() && fits(std::move(best.begin()->second), attempt) &&
          fitter_.log_evidence(out_.fit) > evidence + kClose && !(alone && leaves_hypothesis()))
        return true;
    }
    out_ = before;
    return false;
  }
  /// Adds a moving circle beside the other terms, if it passes the tests. Returns whether there is one.
  bool accept_further_circle() {
    // Chance finds circles with a smaller gain in most sets.
    constexpr double kLeastGain = 30;
    const Attempt attempt{Attempt::Kind::kForm, {"speed-by-position-and-time"}};
    if (!limit().empty() || failed_.contains(attempt)) return false;
    say(kAlternatives, "testing moving circles");
    const std::vector<MovingCircle> circles = moving_circles_of(fitter_, out_.fit, extent_);
    if (circles.empty() || circles.front().gain < kLeastGain) return false;
    Candidates best;
    add_candidates(dictionary_of_circles(out_.fit, extent_, circles), false, kRemnant * explained(), best);
    return !best.empty() && fits(std::move(best.begin()->second), attempt);
  }
  /// Adds the general term with the most evidence that fits. If the error is near what the model expects, only a clear one: an effect
  /// that looks like noise raises what the model expects. Returns whether there is one.
  bool accept_general() {
    if (general_terms_ == kMostGeneral || !limit().empty() || !leaves_much_) return false;
    say(kGeneralTerms, "testing general terms");
    for (GeneralTerm& one : general_candidates(!leaves_much_(out_.fit))) {
      if (worked_out()) break;
      const Attempt attempt{one.term.general ? Attempt::Kind::kGeneral : Attempt::Kind::kForm, {one.term.name}};
      if (!fits(std::move(one), attempt)) continue;
      ++general_terms_;
      --eliminations_;
      return true;
    }
    if (worked_out()) out_.limit = limit();
    return false;
  }
  /// Whether a lag between commands and motion, one number, explains most of what the best hypothesis explains. Then
  /// the model gets the lag.
  bool lag_explains(const Finding& best) {
    constexpr double kMost = 0.8;
    if (fitter_.fit_command_lag(out_.fit, kMost * best.evidence) == 0) return false;
    if (out_.reasons.empty() || starts_anew_) return true;
    // Effects that were found beside a wrong clock may be its artefacts: the search starts anew.
    FitState anew = out_.path.front().fit;
    if (fitter_.fit_command_lag(anew) == 0) return true;
    starts_anew_ = true;
    out_ = {std::move(anew), {}, {out_.path.front()}, {}, {}, {}, {}};
    failed_.clear();
    return true;
  }
  /// Adds calibration shifts of the camera. Returns whether there were any.
  bool accept_calibration_shifts() {
    // A smooth curve of a drift with sudden ends leaves residuals that look like shifts.
    if (std::any_of(out_.fit.model.terms.begin(), out_.fit.model.terms.end(),
                    [](const Term& term) { return term.name == "drift-by-time"; }))
      return false;
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
    if (pushed) out_.ambiguous.push_back({kCalibrationShiftsName, "drift-by-time", covariates, world, 0});
    out_.steps.push_back({kCalibrationShiftsName, finding.evidence});
    return true;
  }
  void add(const Finding& found, double threshold) {
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

  /// Refines the shape of a term. Returns whether that recovers most of the expected gain of a further term.
  bool recovered_by_refinement(std::size_t place, double expected_gain) {
    constexpr double kMost = 0.5;
    const Search before = out_;
    const double likelihood = fitter_.log_likelihood(out_.fit);
    refine_shape(place);
    if (fitter_.log_likelihood(out_.fit) > likelihood + kMost * expected_gain) return true;
    out_ = before;
    return false;
  }

  /// Whether the last term, amplitudes of an accepted curve, was merged with it.
  bool merged() {
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

  /// A term has got the name of another form: steps and ambiguities follow it.
  void note_renamed(const std::string& from, const std::string& to) {
    if (from == to) return;
    for (auto& step : out_.steps)
      if (step.added == from) step.added = to;
    for (Ambiguity& one : out_.ambiguous)
      if (one.found == from) one.found = to;
  }
  /// Refines the shape of a term. It may get another name.
  void refine_shape(std::size_t place) {
    const std::string before = out_.fit.model.terms[place].name;
    refine_form(place);
    note_renamed(before, out_.fit.model.terms[place].name);
  }
  void refine_form(std::size_t place) {
    if (out_.fit.model.terms[place].general) {
      refit(fitter_, out_.fit, place);
      if (!became_switch(place) && separate(fitter_, out_.fit, place)) extend_targets(fitter_, out_.fit, place);
      return;
    }
    if (!refine_neighbour_shape(fitter_, out_.fit, place) && !refine_traffic_shape(fitter_, out_.fit, place))
      refine_curves(fitter_, out_.fit, place);
    // Smooth curves leave residuals of a switch, which would pass the tests as one further term after another.
    if (became_switch(place)) return;
    const std::string before = out_.fit.model.terms[place].name;
    if (refine_wave_numbers(fitter_, out_.fit, place)) refit(fitter_, out_.fit, place);
    if (refine_moving_circle(fitter_, out_.fit, place)) {
      // The curve is sharper about the right centre.
      refine_curves(fitter_, out_.fit, place);
      if (refine_moving_circle(fitter_, out_.fit, place)) refit(fitter_, out_.fit, place);
    }
    const std::string name = find_change_points(fitter_, out_.fit, place);
    if (name != before) {
      for (const Hypothesis& h : dictionary_.hypotheses) {
        if (h.name != name) continue;
        out_.reasons[place].covariates = h.covariates;
        out_.reasons[place].acts_on = h.acts_on;
      }
    }
    fit_total_variation_map(fitter_, out_.fit, place);
    fit_central_distortion(fitter_, out_.fit, place);
    extend_targets(fitter_, out_.fit, place);
  }
  /// Replaces curves per robot or command by amplitudes from an instant on, and these by a change of each wheel, if the evidence
  /// rises. Returns whether there is an instant.
  bool became_switch(std::size_t place) {
    if (!simplify_to_switch(fitter_, out_.fit, place)) return false;
    if (replace_by_wheel_offsets(fitter_, out_.fit, place)) out_.reasons[place].acts_on = "speed of each wheel";
    return true;
  }
  /// Tests camera motion against a drift of the robots. Robots at rest and walls separate the two.
  void try_camera_motion() {
    const auto drift = std::find_if(out_.fit.model.terms.begin(), out_.fit.model.terms.end(),
                                    [](const Term& term) { return term.name == "drift-by-time"; });
    // Once only: otherwise the search could alternate between both.
    if (drift == out_.fit.model.terms.end() ||
        !failed_.insert({Attempt::Kind::kExchange, {"camera-by-time", "drift-by-time"}}).second)
      return;
    const auto place = static_cast<std::size_t>(drift - out_.fit.model.terms.begin());
    const bool at_rest = std::any_of(drift->blocks.begin(), drift->blocks.end(),
                                     [](const Block& block) { return (block.during & ~kDriven) != 0; });
    score_dictionary();
    const Hypothesis* best = nullptr;
    Finding best_finding;
    for (const Hypothesis& h : dictionary_.hypotheses) {
      if (h.name != "camera-by-time") continue;
      const Finding finding = score_test_->evidence_of(h, static_cast<int>(place));
      if (best != nullptr && !(finding.evidence > best_finding.evidence)) continue;
      best = &h;
      best_finding = finding;
    }
    constexpr double kAlike = 0.8;
    if (best == nullptr ||
        (!at_rest &&
         best_finding.evidence < kAlike * score_test_->evidence_of_term(static_cast<int>(place)).evidence))
      return;
    exchanged_for(place, *best, best_finding);
  }
  /// Backward elimination and exchange. Returns whether a term was removed or replaced, so that the search must
  /// continue.
  bool eliminate() {
    if (eliminations_++ >= 3) return false;
    for (int t = 0; t < static_cast<int>(out_.fit.model.terms.size()) && !worked_out(); ++t) {
      const auto place = static_cast<std::size_t>(t);
      const Finding own = score_test_->evidence_of_term(t);
      if (own.held_out < 2 && removed(place, false)) return true;
      if (exchanged(place, own)) return true;
    }
    return false;
  }
  /// Exchanges a term, whose evidence is `own`, for the hypothesis with the most evidence in its place, if that is clearly larger.
  bool exchanged(std::size_t place, const Finding& own) {
    const std::string& name = out_.fit.model.terms[place].name;
    std::vector<const Hypothesis*> others;
    for (const Hypothesis& h : dictionary_.hypotheses) {
      if (h.log_choices > kManyChoices && h.name != name) continue;
      // Amplitudes of this term's curve are no alternative: they contain the curve.
      if (!multiplies_term(out_.fit.model, dictionary_.term_of(h, 1))) others.push_back(&h);
    }
    const std::vector<Finding> findings = score_test_->evidence_of_each(others, static_cast<int>(place));
    const Hypothesis* best = nullptr;
    Finding best_finding;
    for (std::size_t h = 0; h < others.size(); ++h) {
      if (best != nullptr && !(findings[h].evidence > best_finding.evidence)) continue;
      best = others[h];
      best_finding = findings[h];
    }
    return best != nullptr && best->name != name &&
           best_finding.evidence > own.evidence + std::max(kClose, kRemnant * own.evidence) &&
           !failed_.contains({Attempt::Kind::kExchange, {best->name, name}}) &&
           exchanged_for(place, *best, best_finding);
  }
  /// Replaces the last term, of two covariates, by a product of two functions: its columns leave residuals that would pass the tests as one
  /// further term after another. First, another hypothesis may replace it: a product can resemble much.
  void separate_last() {
    const std::size_t last = out_.fit.model.terms.size() - 1;
    FitState product = out_.fit;
    if (!separate(fitter_, product, last)) return;
    score_dictionary();
    if (exchanged(last, score_test_->evidence_of_term(static_cast<int>(last)))) return;
    out_.fit = std::move(product);
    extend_targets(fitter_, out_.fit, last);
  }
  /// Exchanges a term for another hypothesis. The quadratic approximation may overestimate its evidence: restores
  /// the state if the likelihood falls.
  bool exchanged_for(std::size_t place, const Hypothesis& other, Finding finding) {
    const Search before = out_;
    // Contacts show whether the robots move or the camera does.
    const auto acts_on_camera = [&] { return is_measured(out_.fit.model.terms[place].blocks.front().target); };
    const bool was_on_camera = acts_on_camera();
    // With the disc centres of the state before.
    const double likelihood = fitter_.log_likelihood(out_.fit),
                 likelihood_of_all = fitter_.log_likelihood_of_all(out_.fit);
    finding.log10_p = out_.reasons[place].finding.log10_p;
    out_.fit.model.terms[place] = dictionary_.term_of(other, finding.relative_scale);
    out_.reasons[place] = {other.covariates, other.acts_on, finding, out_.reasons[place].threshold_log10_p};
    fitter_.fit(out_.fit, 2);
    if (was_on_camera != acts_on_camera()) {
      refine_shape(place);
      fitter_.fit_contacts(out_.fit);
      if (fitter_.log_likelihood_of_all(out_.fit) > likelihood_of_all - kAsGood) return true;
    } else {
      // Shape refinement can recover a part of the difference only.
      if (fitter_.log_likelihood(out_.fit) > likelihood - kMostByShape) {
        refine_shape(place);
        if (fitter_.log_likelihood(out_.fit) > likelihood - kAsGood) return true;
      }
    }
    out_ = before;
    failed_.insert({Attempt::Kind::kExchange, {other.name, out_.fit.model.terms[place].name}});
    return false;
  }
  /// Whether a term is the constant part of another one.
  static bool is_constant_of(const Term& term, const Term& other) {
    return std::all_of(term.blocks.begin(), term.blocks.end(), [&](const Block& block) {
      return block.basis.factors.empty() &&
             std::any_of(other.blocks.begin(), other.blocks.end(), [&](const Block& b) {
               return b.target == block.target && (b.during & block.during) == block.during;
             });
    });
  }
  /// A new effect may explain what earlier terms were accepted for, unless it has far less evidence. Tries to
  /// remove each earlier term, with the shape of the new one refined.
  void eliminate_earlier() {
    if (multiplies_term(out_.fit.model, out_.fit.model.terms.back())) return;
    constexpr double kFarLess = 0.1;
    for (std::size_t t = out_.fit.model.terms.size() - 1; t-- > 0;) {
      const Term &earlier = out_.fit.model.terms[t], &last = out_.fit.model.terms.back();
      const bool far_less = out_.reasons.back().finding.evidence < kFarLess * out_.reasons[t].finding.evidence;
      if ((!far_less || is_constant_of(earlier, last)) && earlier.name != last.name) removed(t, true);
    }
  }
  /// Removes a term unless the evidence falls.
  bool removed(std::size_t t, bool shape_last) {
    const Search before = out_;
    const double evidence = fitter_.log_evidence(out_.fit);
    out_.fit.model.terms.erase(out_.fit.model.terms.begin() + static_cast<std::ptrdiff_t>(t));
    out_.reasons.erase(out_.reasons.begin() + static_cast<std::ptrdiff_t>(t));
    fitter_.fit(out_.fit, shape_last ? 2 : 1);
    if (shape_last) refine_shape(out_.fit.model.terms.size() - 1);
    if (fitter_.log_evidence(out_.fit) > evidence - kClose) return true;
    out_ = before;
    return false;
  }
  void note_rejected(const ScoreTest::Outcome& outcome) {
    out_.rejected.clear();
    std::vector<const Finding*> order;
    for (const Finding& f : outcome.findings) order.push_back(&f);
    std::sort(order.begin(), order.end(),
              [](const Finding* a, const Finding* b) { return a->log10_p < b->log10_p; });
    for (const Finding* f : order) {
      const Hypothesis& h = hypothesis(*f);
      if (std::any_of(out_.rejected.begin(), out_.rejected.end(),
                      [&](const Rejected& r) { return r.name == h.name; }))
        continue;
      out_.rejected.push_back({h.name, h.covariates, h.acts_on, f->log10_p, outcome.threshold_log10_p, {}});
      if (out_.rejected.size() == 12) break;
    }
  }
  /// Whether an alternative to the last accepted effect, which is now significant beside it, has more evidence in
  /// its place.
  bool replaced_by_alternative(const std::string& name) {
    const auto c = alternatives_.by_name.find(name);
    if (c == alternatives_.by_name.end() ||
        out_.fit.model.terms.size() != alternatives_.before->fit.model.terms.size() + 1 ||
        out_.fit.model.terms.back().name != alternatives_.chosen)
      return false;
    const auto [term, reason] = c->second;
    alternatives_.by_name.erase(c);
    const Search now = out_;
    const double evidence = fitter_.log_evidence(now.fit);
    out_ = *alternatives_.before;
    out_.fit.model.terms.push_back(term);
    out_.reasons.push_back(reason);
    fitter_.fit(out_.fit, 2);
    refine_shape(out_.fit.model.terms.size() - 1);
    fitter_.fit_contacts(out_.fit);
    out_.steps.push_back({term.name, reason.finding.held_out});
    if (fitter_.log_evidence(out_.fit) > evidence) return true;
    out_ = now;
    return false;
  }
  void note_alternatives(const Finding& best, const ScoreTest::Outcome& outcome) {
    const std::string& chosen = hypothesis(best).name;
    alternatives_ = {out_, chosen, {}};
    std::map<std::string, double> most;
    for (const Finding& f : outcome.findings) {
      const Hypothesis& h = hypothesis(f);
      if (f.evidence < std::max(kAlternativeShare * best.evidence, most[h.name]) || h.name == chosen) continue;
      most[h.name] = f.evidence;
      alternatives_.by_name[h.name] = {dictionary_.term_of(h, f.relative_scale),
                                       {h.covariates, h.acts_on, f, outcome.threshold_log10_p}};
    }
  }
  void note_ambiguous(const Finding& best, const ScoreTest::Outcome& outcome) {
    const Hypothesis& chosen = hypothesis(best);
    for (const Finding& f : outcome.findings) {
      const Hypothesis& other = hypothesis(f);
      if (!good(f, outcome.threshold_log10_p) || other.name == chosen.name || f.evidence < best.evidence - kClose)
        continue;
      if (std::any_of(out_.ambiguous.begin(), out_.ambiguous.end(),
                      [&](const Ambiguity& a) { return a.found == chosen.name && a.instead == other.name; }))
        continue;
      out_.ambiguous.push_back({chosen.name, other.name, chosen.covariates, other.covariates,
                                best.evidence - f.evidence, dictionary_.term_of(other, f.relative_scale)});
    }
  }

  const Fitter& fitter_;
  const WorkLog& log_;
  const std::function<bool(const FitState&)>& leaves_much_;
  std::vector<Dictionary> general_;  ///< empty: not needed yet
  int general_terms_ = 0;
  const Extent extent_;
  Dictionary dictionary_;  ///< hypotheses in addition to the model
  std::optional<ScoreTest> score_test_;
  Search out_;
  double base_likelihood_ = 0;
  /// Alternatives to the effect that was accepted last.
  struct Alternatives {
    std::optional<Search> before;  ///< nothing before the first round
    std::string chosen;
    std::map<std::string, std::pair<Term, Reason>> by_name;  ///< by name
  };
  Alternatives alternatives_;
  std::set<Attempt> failed_;
  int eliminations_ = 0, round_ = 0, failures_ = 0;
  bool starts_anew_ = false;  ///< with a lag
};

}  // namespace

Search search(const Fitter& fitter, const FitState& base, const WorkLog& log,
              const std::function<bool(const FitState&)>& leaves_much) {
  return Loop(fitter, base, log, leaves_much).run();
}

}  // namespace kilotwin::identify

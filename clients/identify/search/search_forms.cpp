#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/circle_edges.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/search_loop.hpp"
#include "clients/identify/search/target_extension.hpp"
#include "clients/identify/search/travelling_waves.hpp"

namespace kilotwin::identify {
namespace {

/// General terms of a search, and those that are tried in one round.
constexpr int kMostGeneral = 3;
constexpr std::size_t kMostTries = 4;
/// Largest number of samples in the test of general terms, which have many columns; and where the error that is left looks like
/// noise: enough for a clear effect.
constexpr std::size_t kEnoughForGeneral = 70000, kEnoughForScreening = 25000;

bool is_of_place(const Axis& axis) {
  return axis.of == Covariate::kX || axis.of == Covariate::kY || axis.of == Covariate::kPointDistance ||
         axis.of == Covariate::kAlong;
}

}  // namespace

void SearchLoop::add_candidates(const Dictionary& family, Attempt::Kind kind, double least_evidence,
                                Candidates& best, Tail tail, bool screening) {
  std::vector<Block> blocks = blocks_of(out_.fit.model);
  blocks.insert(blocks.end(), family.blocks.begin(), family.blocks.end());
  const ColumnGroups read = columns_read_by_test(out_.fit.model, family);
  const std::vector<Unit> units =
      linearise(out_.fit.model, tested_units(screening ? kEnoughForScreening : kEnoughForGeneral), blocks,
                {stretch_s(tail), fitter_.threads(), -1, &read});
  const ScoreTest test(fitter_, out_.fit.model, units, family);
  const ScoreTest::Outcome outcome = test.test(kSeed + 100 + static_cast<std::uint64_t>(round_), tail);
  for (const Finding& f : outcome.findings) {
    const Hypothesis& h = family.hypotheses[f.hypothesis];
    const Attempt attempt{kind, {h.name}, tail};
    const auto known = best.find(attempt);
    if (!(screening ? clear(f, outcome.threshold_log10_p) : good(f, outcome.threshold_log10_p)) ||
        f.evidence < least_evidence || failed_.contains(attempt) ||
        (known != best.end() && f.evidence <= known->second.reason.finding.evidence))
      continue;
    GeneralTerm one{
        attempt, family.term_of(h, f.relative_scale), {h.covariates, h.acts_on, f, outcome.threshold_log10_p}};
    one.term.general = kind == Attempt::Kind::kGeneral;
    best.insert_or_assign(attempt, std::move(one));
  }
}

std::vector<SearchLoop::GeneralTerm> SearchLoop::general_candidates(Tail tail, bool screening) {
  if (general_.empty()) general_ = general_dictionaries_of(extent_);
  Candidates best;
  const double least = kRemnant * explained();
  for (const Dictionary& family : general_)
    add_candidates(family, Attempt::Kind::kGeneral, least, best, tail, screening);
  if (!screening) {
    const Dictionary waves = wave_dictionary_of(fitter_, out_.fit, extent_);
    if (!waves.hypotheses.empty()) add_candidates(waves, Attempt::Kind::kWaveForm, least, best, tail);
    const std::vector<MovingCircle> circles = moving_circles_of(fitter_, out_.fit, extent_);
    if (!circles.empty())
      add_candidates(dictionary_of_circles(out_.fit, extent_, circles), Attempt::Kind::kCircleForm, least, best,
                     tail);
  }
  std::vector<GeneralTerm> ranked;
  for (auto& [attempt, one] : best) ranked.push_back(std::move(one));
  std::stable_sort(ranked.begin(), ranked.end(), [](const GeneralTerm& a, const GeneralTerm& b) {
    return a.reason.finding.evidence > b.reason.finding.evidence;
  });
  if (ranked.size() > kMostTries) ranked.resize(kMostTries);
  return ranked;
}

bool SearchLoop::fits(GeneralTerm one, const Attempt& attempt) {
  const Search before = out_;
  const Likelihoods likelihoods = likelihoods_now();
  out_.steps.push_back({one.term.name, one.reason.finding.held_out});
  out_.fit.model.terms.push_back(std::move(one.term));
  out_.reasons.push_back(std::move(one.reason));
  fitter_.fit(out_.fit, 2);
  refine_shape(out_.fit.model.terms.size() - 1);
  fitter_.fit_contacts(out_.fit);
  if (rose_from(likelihoods, attempt.tail)) {
    if (!out_.fit.model.terms.back().general) eliminate_earlier();
    return true;
  }
  out_ = before;
  failed_.insert(attempt);
  return false;
}

bool SearchLoop::accept_wave(double evidence) {
  // Waves below both bounds, in time and over the area, are left out. Smaller values take slow changes of a smooth map for
  // waves.
  constexpr double kFewestPeriods = 1.5, kFewestStripes = 4;
  const Attempt attempt{Attempt::Kind::kWave, {}};
  if (failed_.contains(attempt)) return false;
  const Dictionary waves = wave_dictionary_of(fitter_, out_.fit, extent_);
  if (waves.hypotheses.empty()) return false;
  Candidates best;
  add_candidates(waves, Attempt::Kind::kWaveForm, evidence, best);
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

bool SearchLoop::may_be_part_of_circle(std::size_t t) const {
  const Term& term = out_.fit.model.terms[t];
  if (out_.reasons[t].acts_on != kSpeed.in_words || is_moving_circle(term)) return false;
  return std::all_of(term.blocks.begin(), term.blocks.end(), [](const Block& block) {
    const std::vector<Factor>& factors = block.basis.factors;
    return std::all_of(factors.begin(), factors.end(), [&](const Factor& f) {
      const bool of_some = f.axis.of == Covariate::kRobot || f.axis.of == Covariate::kCommand;
      return is_of_place(f.axis) || only_rises(f.axis) || (of_some && factors.size() > 1);
    });
  });
}

bool SearchLoop::has_parts_of_circle() const {
  bool place = false, rises = false;
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
    if (!may_be_part_of_circle(t)) continue;
    for (const Block& block : out_.fit.model.terms[t].blocks) {
      for (const Factor& f : block.basis.factors) {
        place = place || is_of_place(f.axis);
        rises = rises || only_rises(f.axis);
      }
    }
  }
  return place && rises;
}

bool SearchLoop::accept_moving_circle(bool alone) {
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
    add_candidates(dictionary_of_circles(out_.fit, extent_, circles), Attempt::Kind::kCircleForm,
                   least_share * explained, best);
    if (!best.empty() && fits(std::move(best.begin()->second), attempt)) {
      const Term& last = out_.fit.model.terms.back();
      const double with = fitter_.log_evidence(out_.fit) - (is_moving_circle(last) ? cost_of_circle(last) : 0);
      if (with > evidence + kClose && !(alone && leaves_hypothesis())) {
        Search circle = std::exchange(out_, before);
        if (!became_product_of_parts(with)) out_ = std::move(circle);
        return true;
      }
    }
  }
  out_ = before;
  return false;
}

bool SearchLoop::became_product_of_parts(double evidence) {
  std::vector<std::size_t> of_place, rising;
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
    if (!may_be_part_of_circle(t)) continue;
    const std::vector<Factor> functions = functions_of(main_part(out_.fit.model.terms[t]));
    if (functions.size() != 1) return false;
    if (is_of_place(functions.front().axis)) of_place.push_back(t);
    if (only_rises(functions.front().axis)) rising.push_back(t);
  }
  if (of_place.size() != 1 || rising.size() != 1) return false;
  const Search before = out_;
  const Factor place = functions_of(main_part(out_.fit.model.terms[of_place[0]])).front();
  std::vector<Factor> rise{functions_of(main_part(out_.fit.model.terms[rising[0]])).front()};
  if (rise.front().axis.of != Covariate::kTime) {
    // Driven time or a count of commands may stand for time, the simplest.
    Factor time = over(Factor::Shape::kCosines, Covariate::kTime, 0, extent_.duration_s, 6);
    time.known.assign(time.columns(), 0);
    time.plus = 1;
    rise.insert(rise.begin(), std::move(time));
  }
  std::optional<Search> best;
  for (const Factor& function : rise) {
    out_ = before;
    const double of_product = evidence_of_product(of_place[0], rising[0], {function, place});
    // Negated, so that an evidence that is no number does not count.
    if (!(of_product > evidence)) continue;
    evidence = of_product + kClose;
    best = out_;
  }
  out_ = best.value_or(before);
  if (!best) return false;
  const std::size_t at = std::min(of_place[0], rising[0]);
  out_.steps.push_back({out_.fit.model.terms[at].name, out_.reasons[at].finding.held_out});
  extend_targets(fitter_, out_.fit, at);
  fitter_.fit_contacts(out_.fit);
  return true;
}

double SearchLoop::evidence_of_product(std::size_t of_place, std::size_t rising, std::vector<Factor> functions) {
  std::vector<Term>& terms = out_.fit.model.terms;
  const bool of_time = functions.front().axis.of == Covariate::kTime;
  const std::string name = of_time ? "speed-by-time" : terms[rising].name,
                    word = of_time ? "time" : out_.reasons[rising].covariates.front();
  const std::size_t first = std::min(of_place, rising), second = std::max(of_place, rising);
  terms[first] = main_part(terms[of_place]);
  terms[first].name = name + "-and-position";
  out_.reasons[first].covariates = {word, "position"};
  const Finding of_both[] = {out_.reasons[first].finding, out_.reasons[second].finding};
  out_.reasons[first].finding.evidence = of_both[0].evidence + of_both[1].evidence;
  out_.reasons[first].finding.log10_p = std::min(of_both[0].log10_p, of_both[1].log10_p);
  terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(second));
  out_.reasons.erase(out_.reasons.begin() + static_cast<std::ptrdiff_t>(second));
  return fit_product(fitter_, out_.fit, first, std::move(functions));
}

bool SearchLoop::accept_further_circle() {
  // Chance finds circles with a smaller gain in most sets.
  constexpr double kLeastGain = 30;
  const Attempt attempt{Attempt::Kind::kCircleForm, {"speed-by-position-and-time"}};
  if (!limit().empty() || failed_.contains(attempt)) return false;
  say(kAlternatives, "testing moving circles");
  const std::vector<MovingCircle> circles = moving_circles_of(fitter_, out_.fit, extent_);
  if (circles.empty() || circles.front().gain < kLeastGain) return false;
  Candidates best;
  add_candidates(dictionary_of_circles(out_.fit, extent_, circles), Attempt::Kind::kCircleForm,
                 kRemnant * explained(), best);
  return !best.empty() && fits(std::move(best.begin()->second), attempt);
}

bool SearchLoop::accept_general(Tail tail) {
  if (general_terms_ == kMostGeneral || !limit().empty() || !leaves_much_) return false;
  say(kGeneralTerms, "testing general terms");
  for (GeneralTerm& one : general_candidates(tail, !leaves_much_(out_.fit))) {
    if (worked_out()) break;
    const Attempt attempt = one.attempt;
    if (!fits(std::move(one), attempt)) continue;
    ++general_terms_;
    --eliminations_;
    return true;
  }
  if (worked_out()) out_.limit = limit();
  return false;
}

}  // namespace kilotwin::identify

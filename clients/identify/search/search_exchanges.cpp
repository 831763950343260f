#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "clients/identify/search/amplitudes.hpp"
#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/search_loop.hpp"
#include "clients/identify/search/target_extension.hpp"

namespace kilotwin::identify {
namespace {

/// Hypotheses with more alternatives (as a logarithm) than this, single steps and pulses, are no alternatives in an exchange.
constexpr double kManyChoices = 2.5;
/// Largest loss of log likelihood in an exchange: with few columns, and with the refined shape.
constexpr double kMostByShape = 200, kAsGood = 10;
/// Hypotheses with this share of the best evidence are kept as alternatives: the order may change after shape refinement.
constexpr double kAlternativeShare = 0.97;
/// Others with this share of a term's evidence, and no more than so many, are fitted in its place: about another model, the linear
/// evidence errs by up to some 10 %.
constexpr double kContenderShare = 0.85;
constexpr std::size_t kMostContenders = 2;
/// By how much of a term's evidence another one with no fewer columns must fit better, at most by so many nat: less can come from the
/// forms of both.
constexpr double kClearlyBetter = 0.02, kMostBetter = 50;

}  // namespace

bool SearchLoop::eliminate() {
  if (eliminations_++ >= 3) return false;
  for (int t = 0; t < static_cast<int>(out_.fit.model.terms.size()) && !worked_out(); ++t) {
    const auto place = static_cast<std::size_t>(t);
    const Finding own = score_test_->evidence_of_term(t);
    if ((own.held_out < 2 || product_with(place)) && removed(place, false)) return true;
    if (exchanged(place, own)) return true;
  }
  return false;
}

void SearchLoop::exchange_clocks() {
  Attempt attempt{Attempt::Kind::kClock, {}};
  for (const Term& term : out_.fit.model.terms) attempt.names.push_back(term.name);
  if (worked_out() || !failed_.insert(attempt).second) return;
  for (std::size_t t = 0; t < out_.fit.model.terms.size(); ++t) {
    const std::string before = out_.fit.model.terms[t].name;
    if (!exchange_clock(fitter_, out_.fit, t)) continue;
    // By whole words: "time" is also in "time-since-command".
    std::vector<std::string>& covariates = out_.reasons[t].covariates;
    const bool was_motor = std::find(covariates.begin(), covariates.end(), "motor_time") != covariates.end();
    const std::string from = was_motor ? "-motor-time-" : "-time-", to = was_motor ? "-time-" : "-motor-time-";
    std::string name = before + "-";
    std::size_t at = name.find(from);
    while (at != std::string::npos && name.compare(at, 12, "-time-since-") == 0) at = name.find(from, at + 1);
    if (at != std::string::npos) name.replace(at, from.size(), to);
    name.pop_back();
    out_.fit.model.terms[t].name = name;
    std::replace(covariates.begin(), covariates.end(), std::string(was_motor ? "motor_time" : "time"),
                 std::string(was_motor ? "time" : "motor_time"));
    out_.note_renamed(before, name);
    fitter_.fit_contacts(out_.fit);
  }
}

bool SearchLoop::exchanged(std::size_t place, const Finding& own) {
  const std::string name = out_.fit.model.terms[place].name;  // the term may change below
  std::vector<const Hypothesis*> others;
  for (const Hypothesis& h : dictionary_.hypotheses) {
    if (h.log_choices > kManyChoices && h.name != name) continue;
    // Amplitudes of this term's curve are no alternative: they contain the curve.
    if (!multiplies_term(out_.fit.model, dictionary_.term_of(h, 1))) others.push_back(&h);
  }
  const std::vector<Finding> findings = score_test_->evidence_of_each(others, static_cast<int>(place));
  std::map<std::string, Contender> contenders;  // the best hypothesis of each name
  for (std::size_t h = 0; h < others.size(); ++h) {
    Contender& most = contenders.try_emplace(others[h]->name, Contender{others[h], findings[h]}).first->second;
    if (findings[h].evidence > most.finding.evidence) most = {others[h], findings[h]};
  }
  // The term may be a poor form of its own kind.
  const auto of_name = contenders.find(name);
  const double of_kind = std::max(own.evidence, of_name != contenders.end() ? of_name->second.finding.evidence : 0);
  const double clear = std::max(own.evidence + std::max(kClose, kRemnant * own.evidence), of_kind);
  std::vector<Contender> best;
  for (const auto& [other, contender] : contenders)
    if (other != name && contender.finding.evidence > kContenderShare * of_kind) best.push_back(contender);
  std::sort(best.begin(), best.end(),
            [](const Contender& a, const Contender& b) { return a.finding.evidence > b.finding.evidence; });
  if (best.size() > kMostContenders) best.resize(kMostContenders);
  for (const Contender& one : best) {
    const Attempt attempt{Attempt::Kind::kExchange, {one.hypothesis->name, name}};
    if (failed_.contains(attempt)) continue;
    const bool simpler =
        static_cast<Eigen::Index>(one.hypothesis->columns.size()) < out_.fit.model.terms[place].coefficients.size();
    const double margin = simpler ? kClose : std::clamp(kClearlyBetter * own.evidence, kClose, kMostBetter);
    if (one.finding.evidence > clear ? exchanged_for(place, one) : fits_better(place, one, margin)) return true;
    failed_.insert(attempt);
  }
  return false;
}

void SearchLoop::separate_last() {
  const std::size_t last = out_.fit.model.terms.size() - 1;
  FitState product = out_.fit;
  if (!separate(fitter_, product, last)) return;
  score_dictionary();
  if (exchanged(last, score_test_->evidence_of_term(static_cast<int>(last)))) return;
  out_.fit = std::move(product);
  extend_targets(fitter_, out_.fit, last);
}

void SearchLoop::put(std::size_t place, const Contender& other) {
  Finding finding = other.finding;
  finding.log10_p = out_.reasons[place].finding.log10_p;
  out_.fit.model.terms[place] = dictionary_.term_of(*other.hypothesis, finding.relative_scale);
  out_.reasons[place] = {other.hypothesis->covariates, other.hypothesis->acts_on, finding,
                         out_.reasons[place].threshold_log10_p};
  fitter_.fit_until_settled(out_.fit);
}

double SearchLoop::evidence_with_contacts() const {
  return fitter_.log_evidence(out_.fit) - fitter_.log_likelihood(out_.fit) +
         fitter_.log_likelihood_of_all(out_.fit);
}

void SearchLoop::settle(std::size_t place) {
  refine_shape(place);
  fitter_.fit_contacts(out_.fit);
  fitter_.fit_until_settled(out_.fit);
}

bool SearchLoop::fits_better(std::size_t place, const Contender& other, double margin) {
  const Search before = out_;
  const bool was_on_camera = acts_on_camera(place);
  put(place, other);
  const bool counts_contacts = was_on_camera != acts_on_camera(place);
  const auto evidence = [&] { return counts_contacts ? evidence_with_contacts() : fitter_.log_evidence(out_.fit); };
  settle(place);
  const double of_other = evidence();
  Search contender = std::exchange(out_, before);
  const double own = evidence();
  if (of_other < own + margin) return false;
  // The term may be far from its own maximum.
  settle(place);
  if (of_other > evidence() + margin) {
    out_ = std::move(contender);
    return true;
  }
  return false;
}

bool SearchLoop::acts_on_camera(std::size_t place) const {
  return is_measured(out_.fit.model.terms[place].blocks.front().target);
}

bool SearchLoop::exchanged_for(std::size_t place, const Contender& other) {
  const Search before = out_;
  const bool was_on_camera = acts_on_camera(place);
  // With the disc centres of the state before.
  const double likelihood = fitter_.log_likelihood(out_.fit),
               likelihood_of_all = fitter_.log_likelihood_of_all(out_.fit);
  put(place, other);
  if (was_on_camera != acts_on_camera(place)) {
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
  return false;
}

void SearchLoop::try_camera_motion() {
  const auto drift = std::find_if(out_.fit.model.terms.begin(), out_.fit.model.terms.end(), is_drift_over_time);
  // Once only: otherwise the search could alternate between both.
  if (drift == out_.fit.model.terms.end() ||
      !failed_.insert({Attempt::Kind::kExchange, {effect_name(kCamera, "time"), drift->name}}).second)
    return;
  const auto place = static_cast<std::size_t>(drift - out_.fit.model.terms.begin());
  const bool at_rest = std::any_of(drift->blocks.begin(), drift->blocks.end(),
                                   [](const Block& block) { return (block.during & ~kDriven) != 0; });
  score_dictionary();
  const Hypothesis* best = nullptr;
  Finding best_finding;
  for (const Hypothesis& h : dictionary_.hypotheses) {
    if (!is_camera_over_time(dictionary_.term_of(h, 1))) continue;
    const Finding finding = score_test_->evidence_of(h, static_cast<int>(place));
    if (best != nullptr && !(finding.evidence > best_finding.evidence)) continue;
    best = &h;
    best_finding = finding;
  }
  // Share of the drift's evidence from which a camera that moves is tried in its place. A larger value leaves camera motion
  // as a drift; a smaller one costs fits.
  constexpr double kAlike = 0.8;
  if (best == nullptr || (!at_rest && best_finding.evidence <
                                          kAlike * score_test_->evidence_of_term(static_cast<int>(place)).evidence))
    return;
  exchanged_for(place, {best, best_finding});
}

bool SearchLoop::is_constant_of(const Term& term, const Term& other) {
  return std::all_of(term.blocks.begin(), term.blocks.end(), [&](const Block& block) {
    return block.basis.factors.empty() &&
           std::any_of(other.blocks.begin(), other.blocks.end(), [&](const Block& b) {
             return b.target == block.target && (b.during & block.during) == block.during;
           });
  });
}

void SearchLoop::eliminate_earlier() {
  if (multiplies_term(out_.fit.model, out_.fit.model.terms.back())) return;
  // Share of an earlier effect's evidence below which the last effect cannot have replaced it. A larger value spares fits,
  // and leaves effects that the last one made superfluous.
  constexpr double kFarLess = 0.1;
  for (std::size_t t = out_.fit.model.terms.size() - 1; t-- > 0;) {
    const Term &earlier = out_.fit.model.terms[t], &last = out_.fit.model.terms.back();
    const bool far_less = out_.reasons.back().finding.evidence < kFarLess * out_.reasons[t].finding.evidence;
    if ((!far_less || is_constant_of(earlier, last)) && earlier.name != last.name) removed(t, true);
  }
}

std::optional<std::size_t> SearchLoop::product_with(std::size_t part) const {
  const std::vector<Term>& terms = out_.fit.model.terms;
  for (std::size_t t = 0; t < terms.size(); ++t)
    if (t != part && is_part_of_product(terms[part], terms[t])) return t;
  return std::nullopt;
}

bool SearchLoop::removed(std::size_t t, bool shape_last) {
  const Search before = out_;
  const double evidence = fitter_.log_evidence(out_.fit);
  std::optional<std::size_t> product = product_with(t);
  if (product && *product > t) --*product;
  out_.fit.model.terms.erase(out_.fit.model.terms.begin() + static_cast<std::ptrdiff_t>(t));
  out_.reasons.erase(out_.reasons.begin() + static_cast<std::ptrdiff_t>(t));
  fitter_.fit(out_.fit, shape_last ? 2 : 1);
  if (product)
    refit_product(fitter_, out_.fit, *product);
  else if (shape_last)
    refine_shape(out_.fit.model.terms.size() - 1);
  if (fitter_.log_evidence(out_.fit) > evidence - kClose) return true;
  out_ = before;
  return false;
}

const Finding* SearchLoop::other_form(const Finding& best, const ScoreTest::Outcome& outcome) const {
  const Hypothesis& chosen = hypothesis(best);
  const std::vector<Term>& terms = out_.fit.model.terms;
  if (std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.name == chosen.name; })) return nullptr;
  const auto axis_of = [&](const Hypothesis& h) -> std::optional<Axis> {
    const Term term = dictionary_.term_of(h, 1);
    const std::vector<Factor>& factors = term.blocks.front().basis.factors;
    return factors.empty() ? std::nullopt : std::optional(factors.front().axis);
  };
  const Finding* most = nullptr;
  for (const Finding& f : outcome.findings) {
    if (f.evidence < kAlternativeShare * best.evidence || !good(f, outcome.threshold_log10_p)) continue;
    if (hypothesis(f).name != chosen.name || axis_of(hypothesis(f)) == axis_of(chosen)) continue;
    if (most == nullptr || f.evidence > most->evidence) most = &f;
  }
  return most;
}

void SearchLoop::note_alternatives(const Finding& best, const ScoreTest::Outcome& outcome) {
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

bool SearchLoop::replaced_by_alternative(const std::string& name) {
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

}  // namespace kilotwin::identify

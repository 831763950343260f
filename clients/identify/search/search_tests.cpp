#include <algorithm>
#include <cmath>

#include "clients/identify/search/search_loop.hpp"

namespace kilotwin::identify {

std::vector<std::vector<const TrackView*>> SearchLoop::tested_units(std::size_t most_samples) const {
  std::vector<std::vector<const TrackView*>> units = out_.fit.tracks.units();
  std::size_t samples = 0;
  for (const auto& unit : units)
    for (const TrackView* view : unit) samples += view->track->samples.size();
  const std::size_t every = samples / most_samples + 1;
  std::vector<std::vector<const TrackView*>> part;
  for (std::size_t u = 0; u < units.size(); u += every) part.push_back(units[u]);
  return part.size() >= 6 ? part : units;
}

void SearchLoop::score_dictionary(Tail tail) {
  dictionary_ = dictionary_of(extent_, out_.fit.model.terms);
  std::vector<Block> blocks = blocks_of(out_.fit.model);
  blocks.insert(blocks.end(), dictionary_.blocks.begin(), dictionary_.blocks.end());
  const ColumnGroups read = columns_read_by_test(out_.fit.model, dictionary_);
  const std::vector<Unit> units =
      linearise(out_.fit.model, tested_units(), blocks, {stretch_s(tail), fitter_.threads(), -1, &read});
  score_test_.emplace(fitter_, out_.fit.model, units, dictionary_);
}

const Finding* SearchLoop::best_of(const ScoreTest::Outcome& outcome, double least_evidence, Tail tail) const {
  const Finding* best = nullptr;
  for (const Finding& f : outcome.findings) {
    if (!good(f, outcome.threshold_log10_p) || f.evidence < least_evidence ||
        failed_.contains({Attempt::Kind::kNamed, {hypothesis(f).name}, tail}))
      continue;
    if (of_robots_and_more(hypothesis(f)) && parts_evidence(hypothesis(f), outcome) > f.evidence) continue;
    if (best == nullptr || f.evidence > best->evidence) best = &f;
  }
  return best;
}

bool SearchLoop::of_robots_and_more(const Hypothesis& h) {
  return h.covariates.size() == 2 &&
         std::find(h.covariates.begin(), h.covariates.end(), "robot") != h.covariates.end();
}

double SearchLoop::parts_evidence(const Hypothesis& pair, const ScoreTest::Outcome& outcome) const {
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

bool SearchLoop::good(const Finding& f, double threshold) {
  return f.log10_p < threshold && f.evidence > 3 && f.held_out > 2;
}

bool SearchLoop::clear(const Finding& f, double threshold) {
  // Bounds of a finding that is clear: nat, orders of magnitude below the threshold, and held-out gain; those of a good one
  // are 3, 0 and 2. Larger ones leave fewer findings clear.
  constexpr double kClearEvidence = 5, kClearLog10P = 2, kClearHeldOut = 3;
  return f.log10_p < threshold - kClearLog10P && f.evidence > kClearEvidence && f.held_out > kClearHeldOut;
}

bool SearchLoop::leaves_hypothesis() {
  // Share of all gain: hypotheses with less do not count as left; a smaller value counts remnants.
  constexpr double kFair = 0.02;
  score_dictionary();
  const ScoreTest::Outcome outcome =
      score_test_->test(kSeed + static_cast<std::uint64_t>(round_), Tail::kOfColumns);
  return best_of(outcome, kFair * explained(), Tail::kOfColumns) != nullptr;
}

void SearchLoop::note_rejected(const ScoreTest::Outcome& outcome) {
  out_.rejected.clear();
  std::vector<const Finding*> order;
  for (const Finding& f : outcome.findings) order.push_back(&f);
  std::sort(order.begin(), order.end(), [](const Finding* a, const Finding* b) { return a->log10_p < b->log10_p; });
  for (const Finding* f : order) {
    const Hypothesis& h = hypothesis(*f);
    if (std::any_of(out_.rejected.begin(), out_.rejected.end(),
                    [&](const Rejected& r) { return r.name == h.name; }))
      continue;
    out_.rejected.push_back({h.name, h.covariates, h.acts_on, f->log10_p, outcome.threshold_log10_p, {}});
    if (out_.rejected.size() == 12) break;
  }
}

void SearchLoop::note_ambiguous(const Finding& best, const ScoreTest::Outcome& outcome) {
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

}  // namespace kilotwin::identify

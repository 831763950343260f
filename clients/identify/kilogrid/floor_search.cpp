#include "clients/identify/kilogrid/floor_search.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "clients/identify/kilogrid/floor_walls.hpp"

namespace kilotwin::kilogrid {
namespace {

class Search {
 public:
  Search(const FloorModel& base, const FloorTarget& target, std::vector<FloorTerm> candidates,
         const stats::WorkReport& report, const FloorNote& note)
      : found_{base, {}, {}}, target_(target), candidates_(std::move(candidates)), report_(report), note_(note) {
    progress_ = [this](const std::string& what) { report_({stage_, what, stats::Work::kSame}); };
  }

  FloorFound go() {
    while (found_.gains.size() < kMostEffects && add_one()) continue;
    begin(kWalls, "search, walls");
    const WallGain walls = fit_walls(found_.model, target_, 2, 6000, progress_);
    if (walls.found()) {
      note_(kWallEffect, found_.model);
      found_.gains.push_back({kWallEffect, walls.gain, walls.needed});
    } else {
      reject({kWallEffect, std::max(walls.gain, 0.0), walls.needed}, {"position"}, "WHEEL_GAIN");
    }
    begin(kElimination, "search, backward elimination");
    prune();
    return std::move(found_);
  }

 private:
  void begin(FloorWork kind, const std::string& stage) {
    stage_ = stage;
    report_(floor_work(kind, stage_, static_cast<int>(found_.gains.size()) + (kind == kEffect ? 1 : 0), true));
  }

  /// Adds the effect with the most evidence and refits. False if none is significant.
  bool add_one() {
    const std::uint64_t round = found_.gains.size();
    begin(kEffect, fmt::format("search, round {}", round + 1));
    const Selection choice = choose(found_.model, candidates_, target_, 50 + round, progress_);
    found_.rejected.clear();
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      const FloorTerm& candidate = candidates_[c];
      if (!choice.found() || c != choice.best)
        reject({candidate.name, choice.scores[c].gain, choice.scores[c].needed}, candidate.covariates,
               candidate.acts_on);
    }
    if (!choice.found()) return false;
    const CandidateScore& score = choice.scores[choice.best];
    add(candidates_[choice.best], score.values);
    found_.gains.push_back({candidates_[choice.best].name, score.gain, score.needed});
    candidates_.erase(candidates_.begin() + static_cast<std::ptrdiff_t>(choice.best));
    fit_from_far_start(found_.model, target_, 100 + round, progress_);
    fit(found_.model, target_, 2, 0.8, 100 + round, progress_);
    note_(found_.gains.back().name, found_.model);
    return true;
  }

  void add(const FloorTerm& term, const std::vector<double>& values) {
    found_.model.add(term);
    std::copy(values.begin(), values.end(), found_.model.values.end() - static_cast<std::ptrdiff_t>(values.size()));
  }

  /// Backward elimination: tests each earlier effect against a model fitted without it.
  void prune() {
    const std::size_t terms = found_.model.terms.size() - 1;
    if (terms < 2) return;
    for (std::size_t e = terms - 1; e-- > 0;) {
      FloorModel less = found_.model.without(e + 1);
      const FloorTerm term = found_.model.terms[e + 1];
      fit(less, target_, 1, 0.7, 200 + e, progress_);
      const Selection choice = choose(less, {term}, target_, 70 + e, progress_);
      EffectGain& gain = found_.gains[e];
      gain = {term.name, choice.scores[0].gain, choice.scores[0].needed};
      if (choice.found()) continue;
      found_.rejected.push_back({gain, term.covariates, term.acts_on, "not significant given the other effects"});
      found_.model = less;
      found_.gains.erase(found_.gains.begin() + static_cast<std::ptrdiff_t>(e));
    }
    fit(found_.model, target_, 1, 0.5, 300, progress_);
  }

  void reject(EffectGain gain, std::vector<std::string> covariates, std::string acts_on) {
    const std::string why =
        gain.gain <= 0 ? "does not lower the misfit"
                       : fmt::format("lowers the misfit by {:.0f}; significance bound {:.0f}{}", gain.gain,
                                     gain.needed, gain.gain > gain.needed ? "; no gain on held-out runs" : "");
    found_.rejected.push_back({std::move(gain), std::move(covariates), std::move(acts_on), why});
  }

  FloorFound found_;
  const FloorTarget& target_;
  std::vector<FloorTerm> candidates_;
  const stats::WorkReport& report_;
  FloorProgress progress_;
  std::string stage_;
  const FloorNote& note_;
};

}  // namespace

FloorFound search_effects(const FloorModel& base, const FloorTarget& target,
                          const std::vector<FloorTerm>& candidates, const stats::WorkReport& progress,
                          const FloorNote& note) {
  return Search(base, target, candidates, progress, note).go();
}

}  // namespace kilotwin::kilogrid

#include "clients/identify/kilogrid/floor_choose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>

#include "clients/identify/kilogrid/floor_evidence.hpp"
#include "clients/identify/kilogrid/quick_swarm.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Sets simulated without an effect; and how often the engine simulates the measured runs, to be compared with them.
constexpr std::size_t kSets = 16, kRepeats = 2;
constexpr double kWhole_s = std::numeric_limits<double>::infinity();

std::vector<FloorSet> sets_of(const FloorModel& model, const FloorTarget& target, std::uint64_t seed) {
  const std::size_t scenes = target.scenes().size();
  std::vector<std::vector<RobotSums>> sums(kSets * scenes);
  const FloorSettings settings = model.settings();
  in_parallel(target.threads(), sums.size(), [&](std::size_t i) {
    sums[i] = robot_sums(simulate_quickly(target.scenes()[i % scenes], target.floor(), settings, seed * 1000 + i),
                         target.floor());
  });
  std::vector<FloorSet> sets;
  for (std::size_t b = 0; b < kSets; ++b) {
    const auto first = sums.begin() + static_cast<std::ptrdiff_t>(b * scenes);
    sets.emplace_back(std::vector(std::make_move_iterator(first),
                                  std::make_move_iterator(first + static_cast<std::ptrdiff_t>(scenes))));
  }
  return sets;
}

/// What other sets than this one say together, as many as the engine's repeats.
FloorStatistics others_than(const std::vector<FloorSet>& sets, std::size_t set) {
  std::vector<RobotSums> all;
  for (std::size_t k = 1; k <= kRepeats; ++k) {
    for (const auto& run : sets[(set + k) % sets.size()].runs) all.insert(all.end(), run.begin(), run.end());
  }
  return statistics_of(all);
}

/// Each run's robots, of simulated runs in the order of their scenes, time and again.
FloorStatistics statistics_but(const std::vector<std::vector<RobotSums>>& simulated, std::size_t scenes,
                               const std::function<bool(std::size_t scene)>& in) {
  std::vector<RobotSums> all;
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    if (in(i % scenes)) all.insert(all.end(), simulated[i].begin(), simulated[i].end());
  }
  return statistics_of(all);
}

/// Parameters of the model and of its candidates, as those that are in use.
class Candidates {
 public:
  Candidates(const FloorModel& model, const std::vector<FloorTerm>& candidates)
      : all_(model), candidates_(candidates), in_model_(model.values.size()), terms_(model.terms.size()) {
    for (const FloorTerm& candidate : candidates) all_.add(candidate);
  }
  [[nodiscard]] const FloorModel& all() const { return all_; }
  [[nodiscard]] std::size_t first_of(std::size_t c) const { return all_.first_of(terms_ + c); }
  [[nodiscard]] std::vector<bool> model_only() const {
    std::vector<bool> use(all_.values.size(), false);
    std::fill_n(use.begin(), in_model_, true);
    return use;
  }
  [[nodiscard]] std::vector<bool> with(std::size_t c) const {
    std::vector<bool> use = model_only();
    std::fill_n(use.begin() + static_cast<std::ptrdiff_t>(first_of(c)), candidates_[c].switches, true);
    return use;
  }
  /// Candidates are off; what switches them on is varied, not their shapes.
  [[nodiscard]] std::vector<std::size_t> switches() const {
    std::vector<std::size_t> at;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      for (std::size_t p = 0; p < candidates_[c].switches; ++p) at.push_back(first_of(c) + p);
    }
    return at;
  }

 private:
  FloorModel all_;
  const std::vector<FloorTerm>& candidates_;
  std::size_t in_model_, terms_;
};

/// What stands for chance and for doubt as candidates are weighed.
class Scales {
 public:
  Scales(const Candidates& of, const FloorBox& box) : of_(of), box_(box) {}

  /// What groups of statistics are off by in sets that the model made, as their mean squares.
  void learn(const std::vector<FloorGap>& made) {
    by_chance_.assign(statistic_groups().size(), 0);
    for (const FloorGap& gap : made) {
      const std::vector<double> left = gap.left(gap.best_steps(of_.model_only(), box_));
      for (std::size_t g = 0; g < left.size(); ++g) by_chance_[g] += left[g] / static_cast<double>(made.size());
    }
  }
  /// How far the model with a candidate is from each group of statistics beyond chance, as variances in those of chance: what
  /// it cannot explain there may be anything, and a candidate must not win by it.
  [[nodiscard]] std::vector<double> doubts(const FloorGap& gap, std::size_t c) const {
    std::vector<double> of = gap.left(gap.best_steps(of_.with(c), box_));
    for (std::size_t g = 0; g < of.size(); ++g) of[g] = std::max(1.0, of[g] / std::max(by_chance_[g], 1e-9));
    return of;
  }
  /// What the candidate removes, in that measure.
  [[nodiscard]] double gain(const FloorGap& gap, std::size_t c) const {
    const FloorGap doubting = gap.doubting(doubts(gap, c));
    return doubting.at(doubting.best_steps(of_.model_only(), box_)) -
           doubting.at(doubting.best_steps(of_.with(c), box_));
  }
  /// What it removes of `other`, learned from `own`, both in the measure of `doubts`.
  [[nodiscard]] double gain_of_other(const FloorGap& own, const FloorGap& other, std::size_t c,
                                     const std::vector<double>& doubts) const {
    const FloorGap learned = own.doubting(doubts), judged = other.doubting(doubts);
    return judged.at(learned.best_steps(of_.model_only(), box_)) - judged.at(learned.best_steps(of_.with(c), box_));
  }

 private:
  const Candidates& of_;
  const FloorBox& box_;
  std::vector<double> by_chance_;
};

}  // namespace

bool CandidateScore::helps_others() const {
  if (by_run.empty()) return true;
  double sum = 0;
  std::size_t against = 0;
  for (const double removed : by_run) {
    sum += removed;
    against += removed > 0 ? 0 : 1;
  }
  return sum > 0 && against <= by_run.size() / 4;
}

Choice choose(const FloorModel& model, const std::vector<FloorTerm>& candidates, const FloorTarget& target,
              std::uint64_t seed, const FloorProgress& progress) {
  Choice choice;
  if (candidates.empty()) return choice;
  const Candidates of(model, candidates);
  const std::size_t runs = target.scenes().size();
  const auto simulated = simulated_sums(target, model.settings(), seed * 7 + 3, static_cast<int>(kRepeats));
  const auto here = [&](const std::function<bool(std::size_t)>& in) { return statistics_but(simulated, runs, in); };
  Eigen::MatrixXd slopes = slopes_around(of.all(), target, of.model_only(), 1, kWhole_s, seed);
  add_slopes_of_switches(slopes, of.all(), target, of.switches(), kWhole_s, seed);
  const FloorBox box = box_around(of.all(), 1, 1);
  const std::vector<FloorSet> sets = sets_of(model, target, seed * 3 + 2);
  const Eigen::MatrixXd correlation = correlation_of(sets);

  std::vector<std::optional<FloorGap>> built(sets.size());
  in_parallel(target.threads(), sets.size(), [&](std::size_t b) {
    built[b].emplace(sets[b], others_than(sets, b), slopes, correlation);
  });
  std::vector<FloorGap> made;
  for (std::optional<FloorGap>& gap : built) made.push_back(std::move(*gap));
  Scales scales(of, box);
  scales.learn(made);
  std::vector<std::vector<double>> by_chance(sets.size());
  in_parallel(target.threads(), sets.size(), [&](std::size_t b) {
    for (std::size_t c = 0; c < candidates.size(); ++c) by_chance[b].push_back(scales.gain(made[b], c));
  });
  for (const FloorGap& gap : made)
    choice.by_chance += gap.at(gap.best_steps(of.model_only(), box)) / static_cast<double>(sets.size());
  std::vector<std::size_t> switches;
  for (const FloorTerm& candidate : candidates) switches.push_back(candidate.switches);
  const FloorChance chance(by_chance, switches);
  choice.bound = chance.bound();

  const FloorGap gap(target.set(), here([](std::size_t) { return true; }), slopes, correlation);
  choice.numbers = gap.numbers;
  choice.misfit = gap.at(gap.best_steps(of.model_only(), box));
  // Each run and all but it: what is learned from these must help with it.
  std::vector<FloorGap> alone, others;
  constexpr std::size_t kFewestRuns = 3;
  for (std::size_t r = 0; runs >= kFewestRuns && r < runs; ++r) {
    std::vector<std::vector<RobotSums>> rest = target.set().runs;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(r));
    alone.emplace_back(FloorSet({target.set().runs[r]}), here([r](std::size_t i) { return i == r; }), slopes,
                       correlation);
    others.emplace_back(FloorSet(std::move(rest)), here([r](std::size_t i) { return i != r; }), slopes, correlation);
  }
  std::string tried;
  const auto better = [](const CandidateScore& a, const CandidateScore& b) {
    return a.helps_others() != b.helps_others() ? a.helps_others() : a.evidence > b.evidence;
  };
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const std::vector<double> doubts = scales.doubts(gap, c);
    const FloorGap doubting = gap.doubting(doubts);
    const Eigen::VectorXd steps = doubting.best_steps(of.with(c), box);
    const std::vector<double> values = moved(of.all(), {steps.data(), steps.data() + steps.size()}, 1);
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(of.first_of(c));
    const double gain = doubting.at(doubting.best_steps(of.model_only(), box)) - doubting.at(steps);
    choice.scores.push_back({gain,
                             chance.gain_of(c, choice.bound),
                             chance.evidence(c, gain),
                             {},
                             {first, first + static_cast<std::ptrdiff_t>(candidates[c].parameters.size())}});
    CandidateScore& score = choice.scores.back();
    for (std::size_t r = 0; r < alone.size(); ++r)
      score.by_run.push_back(scales.gain_of_other(others[r], alone[r], c, doubts));
    if (better(score, choice.scores[choice.best])) choice.best = c;
    tried += fmt::format(" {} {:.0f}/{:.0f}", candidates[c].name, gain, score.needed);
    for (std::size_t r = 0; r < score.by_run.size(); ++r)
      tried += fmt::format("{}{:.0f}", r == 0 ? " (" : " ", score.by_run[r]);
    if (!score.by_run.empty()) tried += ")";
  }
  progress(fmt::format("of {:.0f} ({:.0f} by chance, {} numbers) would remove, of what is beyond chance:{}",
                       choice.misfit, choice.by_chance, choice.numbers, tried));
  return choice;
}

}  // namespace kilotwin::kilogrid

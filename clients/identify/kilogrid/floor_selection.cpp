#include "clients/identify/kilogrid/floor_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>

#include "clients/identify/kilogrid/floor_evidence.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Number of simulated sets without an effect, and of engine simulations per measured run.
constexpr int kSets = 16, kRepeats = 2;
constexpr double kWhole_s = std::numeric_limits<double>::infinity();

std::vector<FloorSet> sets_of(const FloorModel& model, const FloorTarget& target, std::uint64_t seed) {
  auto sums = simulated_sums(target, model.settings(), seed, kSets, Simulator::kQuick);
  const auto scenes = static_cast<std::ptrdiff_t>(target.scenes().size());
  std::vector<FloorSet> sets;
  for (auto first = sums.begin(); first != sums.end(); first += scenes)
    sets.emplace_back(std::vector(std::make_move_iterator(first), std::make_move_iterator(first + scenes)));
  return sets;
}

/// Pooled statistics of sets other than this one, as many as the engine's repeats.
FloorStatistics others_than(const std::vector<FloorSet>& sets, std::size_t set) {
  std::vector<std::vector<RobotSums>> others;
  for (std::size_t k = 1; k <= std::size_t{kRepeats}; ++k) {
    for (const auto& run : sets[(set + k) % sets.size()].runs) others.push_back(run);
  }
  return pooled(others);
}

/// Parameters of the model and of the candidates, as masks.
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
  [[nodiscard]] std::vector<bool> with_all() const {
    std::vector<bool> use = model_only();
    for (const std::size_t p : switches()) use[p] = true;
    return use;
  }
  [[nodiscard]] std::vector<bool> with(std::size_t c) const {
    std::vector<bool> use = model_only();
    std::fill_n(use.begin() + static_cast<std::ptrdiff_t>(first_of(c)), candidates_[c].switches, true);
    return use;
  }
  /// Indices of the candidates' amplitudes. Their shape parameters stay fixed in the test.
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

/// Misfit reductions of all candidates on one set.
struct Gains {
  double without = 0;      ///< misfit after a refit without candidates
  double with_all = 0;     ///< misfit after a refit with all candidates
  std::vector<double> of;  ///< per candidate

  Gains(const FloorMisfit& gap, const Candidates& candidates, std::size_t count, const FloorBox& box)
      : without(gap.at(gap.best_steps(candidates.model_only(), box))),
        with_all(gap.at(gap.best_steps(candidates.with_all(), box))) {
    for (std::size_t c = 0; c < count; ++c) of.push_back(without - gap.at(gap.best_steps(candidates.with(c), box)));
  }
};

/// Misfit reduction of a candidate on `other`, with parameters estimated on `own`.
double gain_of_other(const FloorMisfit& own, const FloorMisfit& other, const Candidates& of, std::size_t c,
                     const FloorBox& box) {
  return other.at(own.best_steps(of.model_only(), box)) - other.at(own.best_steps(of.with(c), box));
}

/// Model parameters may move by one scale, candidates by two, since they start at 0.
FloorBox box_of(const FloorModel& all, std::size_t in_model) {
  FloorBox box = box_around(all, 1, 1);
  const FloorBox wide = box_around(all, 1, 2);
  std::copy(wide.least.begin() + static_cast<std::ptrdiff_t>(in_model), wide.least.end(),
            box.least.begin() + static_cast<std::ptrdiff_t>(in_model));
  std::copy(wide.most.begin() + static_cast<std::ptrdiff_t>(in_model), wide.most.end(),
            box.most.begin() + static_cast<std::ptrdiff_t>(in_model));
  return box;
}

std::string in_words(const Selection& choice, const std::vector<FloorTerm>& candidates) {
  std::string tried;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const CandidateScore& score = choice.scores[c];
    tried += fmt::format(" {} {:.0f}/{:.0f}", candidates[c].name, score.gain, score.needed);
    for (std::size_t r = 0; r < score.by_run.size(); ++r)
      tried += fmt::format("{}{:.0f}", r == 0 ? " (" : " ", score.by_run[r]);
    if (!score.by_run.empty()) tried += ")";
  }
  return fmt::format(
      "misfit {:.0f} ({:.0f} in simulated sets, {} statistics, unexplained factor {:.1f}); reduction/bound "
      "(reduction per held-out run):{}",
      choice.misfit, choice.by_chance, choice.numbers, choice.unexplained, tried);
}

}  // namespace

bool CandidateScore::helps_held_out() const {
  if (by_run.empty()) return true;
  double sum = 0;
  std::size_t against = 0;
  for (const double removed : by_run) {
    sum += removed;
    against += removed > 0 ? 0 : 1;
  }
  return sum > 0 && against <= by_run.size() / 4;
}

bool CandidateScore::consistent_over_runs() const {
  if (by_run.size() < 3) return false;
  stats::Moments removed;
  for (const double of_run : by_run) {
    if (!(of_run > 0)) return false;
    removed.add(of_run);
  }
  constexpr double kLevel = 0.01;  // one-sided, Student's t
  return removed.mean() >
         stats::student_quantile(1 - kLevel, static_cast<double>(by_run.size() - 1)) * removed.standard_error();
}

Selection choose(const FloorModel& model, const std::vector<FloorTerm>& candidates, const FloorTarget& target,
                 std::uint64_t seed, const FloorProgress& progress) {
  Selection choice;
  if (candidates.empty()) return choice;
  const Candidates of(model, candidates);
  const std::size_t runs = target.scenes().size();
  const auto simulated = simulated_sums(target, model.settings(), seed * 7 + 3, kRepeats);
  const auto here = [&](const std::function<bool(std::size_t)>& in) {
    return pooled(simulated, [&](std::size_t i) { return in(i % runs); });
  };
  Eigen::MatrixXd slopes = slopes_around(of.all(), target, of.model_only(), 1, kWhole_s, seed);
  add_slopes_of_switches(slopes, of.all(), target, of.switches(), kWhole_s, seed);
  const FloorBox box = box_of(of.all(), model.values.size());
  const std::vector<FloorSet> sets = sets_of(model, target, seed * 3 + 2);
  const Eigen::MatrixXd correlation = correlation_of(sets);

  std::vector<std::optional<Gains>> made(sets.size());
  os::in_parallel(sets.size(), target.threads(), [&](std::size_t b) {
    made[b].emplace(FloorMisfit(sets[b], others_than(sets, b), slopes, correlation), of, candidates.size(), box);
  });
  double all_by_chance = 0;
  std::vector<std::vector<double>> by_chance;
  for (const std::optional<Gains>& set : made) {
    choice.by_chance += set->without / static_cast<double>(sets.size());
    all_by_chance += set->with_all / static_cast<double>(sets.size());
    by_chance.push_back(set->of);
  }
  std::vector<std::size_t> switches;
  for (const FloorTerm& candidate : candidates) switches.push_back(candidate.switches);
  const NullDistribution chance(by_chance, switches);
  choice.bound = chance.bound();

  const FloorMisfit gap(target.set(), here([](std::size_t) { return true; }), slopes, correlation);
  const Gains gains(gap, of, candidates.size(), box);
  choice.numbers = gap.numbers;
  choice.misfit = gains.without;
  // Misfit beyond all candidates inflates the null distribution, as the residual variance of the largest model
  // does in an analysis of variance.
  choice.unexplained = std::max(1.0, gains.with_all / all_by_chance);
  // Leave-one-run-out cross-validation.
  std::vector<FloorMisfit> alone, others;
  constexpr std::size_t kFewestRuns = 3;  // runs; with fewer, nothing is cross-validated
  for (std::size_t r = 0; runs >= kFewestRuns && r < runs; ++r) {
    std::vector<std::vector<RobotSums>> rest = target.set().runs;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(r));
    alone.emplace_back(FloorSet({target.set().runs[r]}), here([r](std::size_t i) { return i == r; }), slopes,
                       correlation);
    others.emplace_back(FloorSet(std::move(rest)), here([r](std::size_t i) { return i != r; }), slopes,
                        correlation);
  }
  const auto better = [&](const CandidateScore& a, const CandidateScore& b) {
    if (a.beyond(choice.bound) != b.beyond(choice.bound)) return a.beyond(choice.bound);
    return a.helps_held_out() != b.helps_held_out() ? a.helps_held_out() : a.evidence > b.evidence;
  };
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Eigen::VectorXd steps = gap.best_steps(of.with(c), box);
    const std::vector<double> values = moved(of.all(), {steps.data(), steps.data() + steps.size()}, 1);
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(of.first_of(c));
    choice.scores.push_back({gains.of[c],
                             chance.gain_of(c, choice.bound) * choice.unexplained,
                             chance.evidence(c, gains.of[c] / choice.unexplained),
                             {},
                             {first, first + static_cast<std::ptrdiff_t>(candidates[c].parameters.size())}});
    CandidateScore& score = choice.scores.back();
    score.uncorrected_evidence = chance.evidence(c, gains.of[c]);
    for (std::size_t r = 0; r < alone.size(); ++r)
      score.by_run.push_back(gain_of_other(others[r], alone[r], of, c, box));
    if (score.consistent_over_runs()) score.needed = chance.gain_of(c, choice.bound);
    if (better(score, choice.scores[choice.best])) choice.best = c;
  }
  progress(in_words(choice, candidates));
  return choice;
}

}  // namespace kilotwin::kilogrid

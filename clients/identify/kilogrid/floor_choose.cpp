#include "clients/identify/kilogrid/floor_choose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

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

/// What candidates remove of a set's misfit. What the model cannot explain with a candidate either counts as if chance were so
/// much larger, as in an F test: a gain is measured by the misfit that it leaves.
struct Gains {
  double without = 0;      ///< misfit, refitted
  std::vector<double> of;  ///< each candidate

  [[nodiscard]] std::vector<double> in_chances(double by_chance) const {
    std::vector<double> all;
    for (const double gain : of) all.push_back(gain / std::max(1.0, (without - gain) / by_chance));
    return all;
  }
  /// The gain that counts for as much as this one does where the misfit is by chance.
  [[nodiscard]] double needed(double in_chances, double by_chance) const {
    return std::max(in_chances, in_chances * without / (by_chance + in_chances));
  }
};

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

}  // namespace

Choice choose(const FloorModel& model, const std::vector<FloorTerm>& candidates, const FloorTarget& target,
              std::uint64_t seed, const FloorProgress& progress) {
  Choice choice;
  if (candidates.empty()) return choice;
  const Candidates of(model, candidates);
  const FloorStatistics here =
      simulated_statistics(target, model.settings(), seed * 7 + 3, static_cast<int>(kRepeats));
  Eigen::MatrixXd slopes = slopes_around(of.all(), target, of.model_only(), 1, kWhole_s, seed);
  add_slopes_of_switches(slopes, of.all(), target, of.switches(), kWhole_s, seed);
  const FloorBox box = box_around(of.all(), 1, 1);
  const std::vector<FloorSet> sets = sets_of(model, target, seed * 3 + 2);
  const Eigen::MatrixXd correlation = correlation_of(sets);

  const auto gains_of = [&](const FloorGap& gap) {
    Gains gains{gap.at(gap.best_steps(of.model_only(), box)), {}};
    for (std::size_t c = 0; c < candidates.size(); ++c)
      gains.of.push_back(gains.without - gap.at(gap.best_steps(of.with(c), box)));
    return gains;
  };
  std::vector<Gains> simulated(sets.size());
  in_parallel(target.threads(), sets.size(), [&](std::size_t b) {
    simulated[b] = gains_of({sets[b], others_than(sets, b), slopes, correlation});
  });
  for (const Gains& set : simulated) choice.by_chance += set.without / static_cast<double>(sets.size());
  std::vector<std::vector<double>> by_chance;
  for (const Gains& set : simulated) by_chance.push_back(set.in_chances(choice.by_chance));
  std::vector<std::size_t> switches;
  for (const FloorTerm& candidate : candidates) switches.push_back(candidate.switches);
  const FloorChance chance(by_chance, switches);
  choice.bound = chance.bound();

  const FloorGap gap(target.set(), here, slopes, correlation);
  choice.numbers = gap.numbers;
  const Gains gains = gains_of(gap);
  const std::vector<double> in_chances = gains.in_chances(choice.by_chance);
  choice.misfit = gains.without;
  std::string tried;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const Eigen::VectorXd steps = gap.best_steps(of.with(c), box);
    const std::vector<double> values = moved(of.all(), {steps.data(), steps.data() + steps.size()}, 1);
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(of.first_of(c));
    choice.scores.push_back({gains.of[c],
                             gains.needed(chance.gain_of(c, choice.bound), choice.by_chance),
                             chance.evidence(c, in_chances[c]),
                             {first, first + static_cast<std::ptrdiff_t>(candidates[c].parameters.size())}});
    if (choice.scores[c].evidence > choice.scores[choice.best].evidence) choice.best = c;
    tried += fmt::format(" {} {:.0f}/{:.0f}", candidates[c].name, gains.of[c], choice.scores[c].needed);
  }
  progress(fmt::format("of {:.0f} ({:.0f} by chance, {} numbers) would remove, of what is beyond chance:{}",
                       choice.misfit, choice.by_chance, choice.numbers, tried));
  return choice;
}

}  // namespace kilotwin::kilogrid

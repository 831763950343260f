#include "clients/identify/kilogrid/floor_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/quick_swarm.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Runs of the design are cut to that: what parameters change shows soon.
constexpr double kExplored_s = 1500;

/// Where a model of `m` parameters stands on a design of runs, in steps: each parameter balanced between up and down.
std::vector<std::vector<double>> design_of(std::size_t parameters, std::size_t points, Dice& dice) {
  std::vector<std::vector<double>> design(points, std::vector<double>(parameters, 0));
  for (std::size_t p = 0; p < parameters; ++p) {
    std::vector<double> levels;
    for (std::size_t i = 0; i < points; ++i)
      levels.push_back(2 * (static_cast<double>(i) + 0.5) / static_cast<double>(points) - 1);
    for (std::size_t i = points; i-- > 1;) std::swap(levels[i], levels[dice.bits() % (i + 1)]);
    for (std::size_t i = 0; i < points; ++i) design[i][p] = levels[i];
  }
  return design;
}

std::vector<double> moved(const std::vector<FloorParameter>& parameters, const std::vector<double>& from,
                          const std::vector<double>& steps, double width) {
  std::vector<double> to;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const FloorParameter& parameter = parameters[p];
    to.push_back(std::clamp(from[p] + steps[p] * width * parameter.width, parameter.least, parameter.most));
  }
  return to;
}

/// Statistics as a linear function of the parameters around a model, in tolerances: residual = off + slopes * steps.
struct Surrogate {
  Eigen::VectorXd off;     ///< simulated less measured
  Eigen::MatrixXd slopes;  ///< per statistic and parameter
};

/// A slope with this variance, less what chance makes of it. Many statistics do not depend on a parameter; what chance makes of
/// those would only dampen steps.
double beyond_chance(double slope, double variance) {
  constexpr double kBeyond = 1;
  return slope * std::max(0.0, 1 - kBeyond * variance / std::max(slope * slope, 1e-30));
}

/// Statistics at one point of the design: of one of the runs, in turn, and not of all of it. Quickly: what is taken from
/// these runs is how they differ from each other.
FloorStatistics statistics_at(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                              std::size_t point) {
  FloorScene scene = target.scenes()[point % target.scenes().size()];
  scene.duration_s = std::min(scene.duration_s, kExplored_s);
  return statistics_of(robot_sums(simulate_quickly(scene, target.floor(), settings, seed), target.floor()));
}

/// `here`: the model's statistics. `moves`: which parameters are varied; the others have slopes of 0.
Surrogate explore(const FloorModel& model, const FloorTarget& target, const FloorStatistics& here,
                  const std::vector<bool>& moves, double width, std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const auto moving = static_cast<std::size_t>(std::count(moves.begin(), moves.end(), true));
  // Four for each: less, and what chance makes of the slopes leads steps astray.
  const std::size_t points = 4 * moving + 12;
  Dice dice(seed);
  auto design = design_of(parameters.size(), points, dice);
  for (std::vector<double>& steps : design) {
    for (std::size_t p = 0; p < steps.size(); ++p) steps[p] = moves[p] ? steps[p] : 0;
  }
  std::vector<FloorStatistics> results(points);
  std::vector<std::vector<double>> at(points);
  for (std::size_t i = 0; i < points; ++i) at[i] = moved(parameters, model.values, design[i], width);
  in_parallel(target.threads(), points, [&](std::size_t i) {
    // The same robots in all of them, scene by scene.
    results[i] = statistics_at(target, model.settings(at[i]), seed * 1000 + i % target.scenes().size(), i);
  });

  // Each run has a column of its own, for what it has begun with.
  const auto rows = static_cast<Eigen::Index>(points), columns = static_cast<Eigen::Index>(parameters.size());
  const auto scenes = static_cast<Eigen::Index>(target.scenes().size());
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(rows, scenes + columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    x(i, i % scenes) = 1;
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto q = static_cast<std::size_t>(p);
      // What was really done, within the parameter's range.
      x(i, scenes + p) = (at[static_cast<std::size_t>(i)][q] - model.values[q]) / (width * parameters[q].width);
    }
  }
  // A little ridge: a parameter at the end of its range moves to one side only.
  Eigen::MatrixXd normal = x.transpose() * x;
  normal.diagonal().tail(columns).array() += 0.02 * static_cast<double>(points);
  const Eigen::MatrixXd inverse = normal.inverse();
  const double spare = std::max(static_cast<double>(rows - scenes - columns), 1.0);
  const auto statistics = static_cast<Eigen::Index>(statistic_count());
  Surrogate surrogate{Eigen::VectorXd::Zero(statistics), Eigen::MatrixXd::Zero(statistics, columns)};
  for (Eigen::Index s = 0; s < statistics; ++s) {
    const auto q = static_cast<std::size_t>(s);
    const double off = here.value[q] - target.statistics().value[q];
    if (!(target.tolerance()[q] > 0) || !std::isfinite(off)) continue;
    const double sd = std::sqrt(target.tolerance()[q] + here.variance[q]);
    surrogate.off(s) = off / sd;
    Eigen::VectorXd y(rows);
    bool known = true;
    for (Eigen::Index i = 0; i < rows; ++i) {
      y(i) = results[static_cast<std::size_t>(i)].value[q] / sd;
      known = known && std::isfinite(y(i));
    }
    if (!known) continue;  // not in all of these runs
    const Eigen::VectorXd line = inverse * (x.transpose() * y);
    const double variance = (y - x * line).squaredNorm() / spare;
    for (Eigen::Index p = 0; p < columns; ++p) {
      surrogate.slopes(s, p) = beyond_chance(line(scenes + p), variance * inverse(scenes + p, scenes + p));
    }
  }
  return surrogate;
}

/// Slopes of parameters that are 0 in the model, each by itself: a width of it against none, in the same runs. What else is
/// in the model stays as it is, so that small runs show it.
void switch_on(Surrogate& surrogate, const FloorModel& model, const FloorTarget& target,
               const FloorStatistics& here, const std::vector<std::size_t>& switches, std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const std::size_t scenes = std::min<std::size_t>(target.scenes().size(), 4);
  // First without any, more often since all are compared with it.
  const std::size_t without = scenes * 4, count = without + switches.size() * scenes;
  std::vector<FloorStatistics> results(count);
  in_parallel(target.threads(), count, [&](std::size_t i) {
    std::vector<double> values = model.values;
    if (i >= without) {
      const std::size_t p = switches[(i - without) / scenes];
      values[p] = std::min(values[p] + parameters[p].width, parameters[p].most);
    }
    results[i] = statistics_at(target, model.settings(values), seed * 1000 + 500 + i, i % scenes);
  });
  const auto mean = [&](std::size_t first, std::size_t n, std::size_t s) {
    std::pair<double, double> m{0, 0};  // and its variance
    for (std::size_t i = first; i < first + n; ++i) {
      m.first += results[i].value[s] / static_cast<double>(n);
      m.second += results[i].variance[s] / static_cast<double>(n * n);
    }
    return m;
  };
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    const double scale = target.tolerance()[s] + here.variance[s];
    if (!(scale > 0) || !std::isfinite(here.value[s] - target.statistics().value[s])) continue;
    const auto [none, none_variance] = mean(0, without, s);
    for (std::size_t k = 0; k < switches.size(); ++k) {
      const auto [on, variance] = mean(without + k * scenes, scenes, s);
      const double slope = on - none, chance = variance + none_variance;
      if (!std::isfinite(slope + chance)) continue;
      surrogate.slopes(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(switches[k])) =
          beyond_chance(slope, chance) / std::sqrt(scale);
    }
  }
}

/// Single statistics that no parameter can reach must not pull at all of them: weights fall beyond three tolerances.
Eigen::VectorXd weights_of(const Eigen::VectorXd& off) {
  return off.unaryExpr([](double r) { return std::abs(r) < 3 ? 1.0 : 3 / std::abs(r); });
}

/// What counts how much as parameters are fitted: what windows of tracks say counts most, since that is what is seen
/// when runs are told apart. Which effects there are is decided with all alike.
constexpr double kWindows = 2.5;
const Eigen::VectorXd& importance() {
  static const Eigen::VectorXd all = [] {
    Eigen::VectorXd v = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(statistic_count()));
    for (const StatisticGroup& group : statistic_groups()) {
      if (group.name.starts_with("windows"))
        v.segment(static_cast<Eigen::Index>(group.first), static_cast<Eigen::Index>(group.size()))
            .setConstant(kWindows);
    }
    return v;
  }();
  return all;
}

/// Steps, at most `most` of each, that lower the misfit most; only of parameters in use. The larger `stay`, the less go
/// those that the misfit hardly depends on.
Eigen::VectorXd best_steps(const Surrogate& surrogate, const std::vector<bool>& in_use, double most,
                           const Eigen::VectorXd& weights, double stay) {
  const Eigen::Index columns = surrogate.slopes.cols();
  Eigen::VectorXd steps = Eigen::VectorXd::Zero(columns);
  // Coordinate descent: small, and it keeps to the box.
  Eigen::VectorXd residual = surrogate.off;
  for (int sweep = 0; sweep < 300; ++sweep) {
    for (Eigen::Index p = 0; p < columns; ++p) {
      if (!in_use[static_cast<std::size_t>(p)]) continue;
      const auto slope = surrogate.slopes.col(p);
      const double curve = (weights.array() * slope.array().square()).sum() + stay;
      const double pull = (weights.array() * slope.array() * residual.array()).sum() + stay * steps(p);
      const double to = std::clamp(steps(p) - pull / curve, -most, most);
      residual += (to - steps(p)) * slope;
      steps(p) = to;
    }
  }
  return steps;
}

/// The misfit as steps lower it: what is far off counts by its size, not by its square.
double robust_misfit(const FloorTarget& target, const FloorStatistics& at) {
  double sum = 0;
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    const double variance = target.tolerance()[s] + at.variance[s];
    const double off = (at.value[s] - target.statistics().value[s]) / std::sqrt(variance);
    if (std::isfinite(off) && target.tolerance()[s] > 0)
      sum += importance()(static_cast<Eigen::Index>(s)) * off * off * std::min(1.0, 3 / std::abs(off));
  }
  return sum;
}

double expected(const Surrogate& surrogate, const Eigen::VectorXd& steps) {
  const Eigen::VectorXd weights = weights_of(surrogate.off);
  const Eigen::VectorXd residual = surrogate.off + surrogate.slopes * steps;
  return (weights.array() * residual.array().square()).sum();
}

}  // namespace

double fit(FloorModel& model, const FloorTarget& target, int rounds, double width, std::uint64_t seed,
           const FloorProgress& progress) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const std::vector<bool> all(parameters.size(), true);
  model.later = target.later();
  // The same chance for all, so that misfits differ by what the models differ.
  const std::uint64_t chance = seed * 7 + 1;
  FloorStatistics at = simulated_statistics(target, model.settings(), chance);
  double misfit = robust_misfit(target, at);
  for (int round = 0; round < rounds; ++round) {
    const Surrogate surrogate =
        explore(model, target, at, all, width, seed * 10 + static_cast<std::uint64_t>(round));
    const FloorModel before = model;
    // A step that leads away was too long for the surrogate.
    constexpr double kLongest = 1.5, kShortest = 0.3, kStay = 3;
    const Eigen::VectorXd weights = weights_of(surrogate.off).cwiseProduct(importance());
    double most = kLongest;
    for (; most > kShortest; most /= 2.5) {
      const Eigen::VectorXd steps = best_steps(surrogate, all, most, weights, kStay);
      model.values = moved(parameters, before.values, {steps.data(), steps.data() + steps.size()}, width);
      const FloorStatistics there = simulated_statistics(target, model.settings(), chance);
      const double now = robust_misfit(target, there);
      progress(fmt::format("misfit {:.0f} -> {:.0f} of {} statistics", misfit, now, target.size()));
      if (now < misfit) {
        misfit = now;
        at = there;
        break;
      }
      model = before;
    }
    width *= most > kShortest ? 0.8 : 0.5;
  }
  return target.misfit(at);
}

double fit_walls(FloorModel& model, const FloorTarget& target, int rounds, std::uint64_t seed, double least_gain,
                 const FloorProgress& progress) {
  const StatisticGroup& group = statistic_group("occupancy-of-the-rim");
  // Robots stay the longer, the slower they are; a few blocks more or less say nothing.
  constexpr double kSome = 1e-3, kPower = 0.8, kSlowest = 0.02, kFastest = 1.2;
  FloorStatistics at = simulated_statistics(target, model.settings(), seed);
  double misfit = target.misfit(at);
  double to_beat = misfit - least_gain;
  FloorModel best = model;
  if (!model.wall) model.wall.emplace().fill(1);
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < kRimParts; ++i) {
      const double ratio =
          (at.value[group.first + i] + kSome) / (target.statistics().value[group.first + i] + kSome);
      (*model.wall)[i] = std::clamp((*model.wall)[i] * std::pow(ratio, kPower), kSlowest, kFastest);
    }
    at = simulated_statistics(target, model.settings(), seed + 1 + static_cast<std::uint64_t>(round));
    const double now = target.misfit(at);
    progress(fmt::format("beside walls: misfit {:.0f} -> {:.0f}", misfit, now));
    if (now < to_beat) {
      misfit = to_beat = now;
      best = model;
    }
  }
  model = best;
  return misfit;
}

std::vector<CandidateScore> choose(const FloorModel& model, const std::vector<FloorTerm>& candidates,
                                   const FloorTarget& target, double least_gain, std::uint64_t seed,
                                   const FloorProgress& progress, std::vector<double>* gains) {
  FloorModel all = model;
  for (const FloorTerm& candidate : candidates) all.add(candidate);
  const std::vector<FloorParameter> parameters = all.parameters();
  // Candidates are off; what switches them on is varied, not their shapes.
  std::vector<bool> moves(parameters.size(), true), in_use(parameters.size(), false);
  std::fill(in_use.begin(), in_use.begin() + static_cast<std::ptrdiff_t>(model.values.size()), true);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const std::size_t first = all.first_of(model.terms.size() + c);
    for (std::size_t p = candidates[c].switches; p < candidates[c].parameters.size(); ++p) moves[first + p] = false;
  }
  std::vector<bool> base(parameters.size(), false);
  std::fill(base.begin(), base.begin() + static_cast<std::ptrdiff_t>(model.values.size()), true);
  const FloorStatistics here = simulated_statistics(target, model.settings(), seed * 7 + 3);
  Surrogate surrogate = explore(all, target, here, base, 1, seed);
  std::vector<std::size_t> switches;
  for (std::size_t p = model.values.size(); p < moves.size(); ++p) {
    if (moves[p]) switches.push_back(p);
  }
  switch_on(surrogate, all, target, here, switches, seed);
  std::vector<CandidateScore> chosen;
  std::vector<bool> taken(candidates.size(), false);
  if (gains != nullptr) gains->assign(candidates.size(), 0);
  constexpr double kStay = 0.3;
  const Eigen::VectorXd weights = weights_of(surrogate.off);
  double without = expected(surrogate, best_steps(surrogate, in_use, 1, weights, kStay));
  while (chosen.size() < candidates.size()) {
    CandidateScore best{candidates.size(), 0, {}};
    std::string tried;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (taken[c]) continue;
      const std::size_t first = all.first_of(model.terms.size() + c), count = candidates[c].parameters.size();
      std::vector<bool> with = in_use;
      std::fill_n(with.begin() + static_cast<std::ptrdiff_t>(first), count, true);
      const Eigen::VectorXd steps = best_steps(surrogate, with, 1, weights, kStay);
      const double gain = without - expected(surrogate, steps);
      if (gains != nullptr) (*gains)[c] = gain;
      tried += fmt::format(" {} {:.0f}", candidates[c].name, gain);
      if (gain <= best.gain) continue;
      const std::vector<double> values =
          moved(parameters, all.values, {steps.data(), steps.data() + steps.size()}, 1);
      best = {c, gain, {}};
      best.values.assign(values.begin() + static_cast<std::ptrdiff_t>(first),
                         values.begin() + static_cast<std::ptrdiff_t>(first + count));
    }
    progress(fmt::format("of {:.0f} would remove:{}", without, tried));
    if (best.gain < least_gain) break;
    taken[best.candidate] = true;
    std::fill_n(in_use.begin() + static_cast<std::ptrdiff_t>(all.first_of(model.terms.size() + best.candidate)),
                best.values.size(), true);
    without -= best.gain;
    chosen.push_back(std::move(best));
  }
  return chosen;
}

}  // namespace kilotwin::kilogrid

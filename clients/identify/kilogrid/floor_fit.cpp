#include "clients/identify/kilogrid/floor_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

namespace kilotwin::kilogrid {
namespace {

/// No statistic is taken for more exact than that share of it: the program, the cells and the walls are idealised.
constexpr double kExact = 0.02;
constexpr unsigned kThreads = 2;

/// Calls work(0), work(1)... work(n - 1), on several threads.
void in_parallel(std::size_t n, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (unsigned t = 0; t < kThreads; ++t) {
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < n; i = next++) work(i);
    });
  }
}

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

/// Statistics at one point of the design: of some of the runs, in turn, since their differences are small beside those of the
/// points.
FloorStatistics statistics_at(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                              std::size_t point) {
  constexpr std::size_t kRunsPerPoint = 2;
  std::vector<RobotSums> all;
  const std::size_t scenes = target.scenes().size();
  for (std::size_t i = 0; i < std::min(kRunsPerPoint, scenes); ++i) {
    const std::size_t scene = (2 * point + i) % scenes;
    const FloorRun run = simulate(target.scenes()[scene], target.floor(), settings.model, settings.times,
                                  settings.radio, seed * 100 + i);
    std::vector<RobotSums> sums = robot_sums(run, target.floor());
    all.insert(all.end(), std::make_move_iterator(sums.begin()), std::make_move_iterator(sums.end()));
  }
  return statistics_of(all);
}

/// `moves`: which parameters are varied; the others have slopes of 0.
Surrogate explore(const FloorModel& model, const FloorTarget& target, const std::vector<bool>& moves, double width,
                  std::uint64_t seed) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const auto moving = static_cast<std::size_t>(std::count(moves.begin(), moves.end(), true));
  const std::size_t points = 3 * moving / 2 + 10;
  Dice dice(seed);
  auto design = design_of(parameters.size(), points, dice);
  for (std::vector<double>& steps : design) {
    for (std::size_t p = 0; p < steps.size(); ++p) steps[p] = moves[p] ? steps[p] : 0;
  }
  std::vector<FloorStatistics> results(points);
  std::vector<std::vector<double>> at(points);
  for (std::size_t i = 0; i < points; ++i) at[i] = moved(parameters, model.values, design[i], width);
  in_parallel(points, [&](std::size_t i) {
    results[i] = statistics_at(target, model.settings(at[i]), seed * 1000 + i, i);
  });

  const auto rows = static_cast<Eigen::Index>(points), columns = static_cast<Eigen::Index>(parameters.size());
  Eigen::MatrixXd x(rows, columns + 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    x(i, 0) = 1;
    for (Eigen::Index p = 0; p < columns; ++p) {
      const auto q = static_cast<std::size_t>(p);
      // What was really done, within the parameter's range.
      x(i, p + 1) = (at[static_cast<std::size_t>(i)][q] - model.values[q]) / (width * parameters[q].width);
    }
  }
  // A little ridge: a parameter at the end of its range moves to one side only.
  Eigen::MatrixXd normal = x.transpose() * x;
  normal.diagonal().tail(columns).array() += 0.02 * static_cast<double>(points);
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  const auto statistics = static_cast<Eigen::Index>(statistic_count());
  Surrogate surrogate{Eigen::VectorXd::Zero(statistics), Eigen::MatrixXd::Zero(statistics, columns)};
  for (Eigen::Index s = 0; s < statistics; ++s) {
    const auto q = static_cast<std::size_t>(s);
    if (!(target.tolerance()[q] > 0)) continue;
    Eigen::VectorXd y(rows);
    bool known = true;
    for (Eigen::Index i = 0; i < rows; ++i) {
      y(i) = (results[static_cast<std::size_t>(i)].value[q] - target.statistics().value[q]) /
             std::sqrt(target.tolerance()[q]);
      known = known && std::isfinite(y(i));
    }
    if (!known) continue;  // not in all of these runs
    const Eigen::VectorXd line = solver.solve(x.transpose() * y);
    surrogate.off(s) = line(0);
    surrogate.slopes.row(s) = line.tail(columns).transpose();
  }
  return surrogate;
}

/// Single statistics that no parameter can reach must not pull at all of them: weights fall beyond three tolerances.
Eigen::VectorXd weights_of(const Eigen::VectorXd& off) {
  return off.unaryExpr([](double r) { return std::abs(r) < 3 ? 1.0 : 3 / std::abs(r); });
}

/// Steps, at most `most` of each, that lower the misfit most; only of parameters in use.
Eigen::VectorXd best_steps(const Surrogate& surrogate, const std::vector<bool>& in_use, double most) {
  const Eigen::Index columns = surrogate.slopes.cols();
  Eigen::VectorXd steps = Eigen::VectorXd::Zero(columns);
  const Eigen::VectorXd weights = weights_of(surrogate.off);
  // Coordinate descent: small, and it keeps to the box.
  Eigen::VectorXd residual = surrogate.off;
  constexpr double kStay = 0.3;
  for (int sweep = 0; sweep < 300; ++sweep) {
    for (Eigen::Index p = 0; p < columns; ++p) {
      if (!in_use[static_cast<std::size_t>(p)]) continue;
      const auto slope = surrogate.slopes.col(p);
      const double curve = (weights.array() * slope.array().square()).sum() + kStay;
      const double pull = (weights.array() * slope.array() * residual.array()).sum() + kStay * steps(p);
      const double to = std::clamp(steps(p) - pull / curve, -most, most);
      residual += (to - steps(p)) * slope;
      steps(p) = to;
    }
  }
  return steps;
}

double expected(const Surrogate& surrogate, const Eigen::VectorXd& steps) {
  const Eigen::VectorXd weights = weights_of(surrogate.off);
  const Eigen::VectorXd residual = surrogate.off + surrogate.slopes * steps;
  return (weights.array() * residual.array().square()).sum();
}

/// The chance of a message along the rim, brought nearer to where robots stay as long as they were measured to.
void update_rim(FloorModel& model, const FloorTarget& target, const FloorStatistics& simulated) {
  const StatisticGroup& group = statistic_group("occupancy-of-the-rim");
  constexpr double kSome = 5e-4, kPower = 0.8, kLeast = 0.02, kMost = 2;
  for (std::size_t i = 0; i < kRimParts; ++i) {
    const double ratio =
        (simulated.value[group.first + i] + kSome) / (target.statistics().value[group.first + i] + kSome);
    model.rim[i] = std::clamp(model.rim[i] * std::pow(ratio, kPower), kLeast, kMost);
  }
}

/// The order in which modules listen to their cells, from successive reports to two cells of one module: where nothing
/// favours an order, as many go from one to the other as back.
std::array<double, 4> order_of_listening(const std::vector<FloorRun>& runs, const Floor& floor) {
  std::array<std::array<double, 4>, 4> count{};
  for (const FloorRun& run : runs) {
    for (const FloorTrack& track : run.tracks) {
      for (std::size_t i = 1; i < track.size(); ++i) {
        if (track.time_s[i] - track.time_s[i - 1] != 2) continue;
        const auto cell = [&](std::size_t k) {
          return std::pair{static_cast<std::size_t>(track.x_mm[k] / floor.cell_mm),
                           static_cast<std::size_t>(track.y_mm[k] / floor.cell_mm)};
        };
        const auto [x0, y0] = cell(i - 1);
        const auto [x1, y1] = cell(i);
        if (x0 / 2 == x1 / 2 && y0 / 2 == y1 / 2) ++count[x0 % 2 + 2 * (y0 % 2)][x1 % 2 + 2 * (y1 % 2)];
      }
    }
  }
  // Neighbouring pairs are 01, 23 along x and 02, 13 along y; the diagonal ones are 12 and 03.
  const double by_1 = count[0][1] + count[2][3], by_3 = count[1][0] + count[3][2];
  const double by_2 = (count[0][2] + count[2][0] + count[1][3] + count[3][1]) / 2;
  const double all = by_1 + by_2 + by_3;
  if (!(all > 0)) return {0.25, 0.25, 0.25, 0.25};
  return {0.25, 0.75 * by_1 / all, 0.75 * by_2 / all, 0.75 * by_3 / all};
}

}  // namespace

FloorTarget::FloorTarget(const std::vector<FloorRun>& runs, const Floor& floor)
    : floor_(floor), later_(order_of_listening(runs, floor)) {
  std::vector<RobotSums> all;
  std::vector<FloorStatistics> each;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    scenes_.push_back(scene_of(runs[i], floor, i + 1));
    const std::vector<RobotSums> sums = robot_sums(runs[i], floor);
    each.push_back(statistics_of(sums));
    all.insert(all.end(), sums.begin(), sums.end());
  }
  statistics_ = statistics_of(all);
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    const double mean = statistics_.value[s];
    double spread = 0, count = 0;
    for (const FloorStatistics& run : each) {
      if (!std::isfinite(run.value[s])) continue;
      spread += (run.value[s] - mean) * (run.value[s] - mean);
      ++count;
    }
    const double between = count > 1 ? spread / (count - 1) / count : 0;
    tolerance_.push_back(std::max(statistics_.variance[s], between) + kExact * kExact * mean * mean);
  }
}

std::size_t FloorTarget::size() const {
  return static_cast<std::size_t>(
      std::count_if(tolerance_.begin(), tolerance_.end(), [](double t) { return t > 0; }));
}

double FloorTarget::misfit(const FloorStatistics& simulated, const StatisticGroup& group) const {
  double sum = 0;
  for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
    const double off = simulated.value[s] - statistics_.value[s];
    const double tolerance = tolerance_[s] + simulated.variance[s];
    if (std::isfinite(off) && tolerance > 0) sum += off * off / tolerance;
  }
  return sum;
}

double FloorTarget::misfit(const FloorStatistics& simulated) const {
  double sum = 0;
  for (const StatisticGroup& group : statistic_groups()) sum += misfit(simulated, group);
  return sum;
}

std::vector<FloorRun> simulate_scenes(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                                      int repeats) {
  const std::size_t scenes = target.scenes().size();
  std::vector<FloorRun> runs(scenes * static_cast<std::size_t>(repeats));
  in_parallel(runs.size(), [&](std::size_t i) {
    runs[i] = simulate(target.scenes()[i % scenes], target.floor(), settings.model, settings.times, settings.radio,
                       seed * 100 + i);
  });
  return runs;
}

FloorStatistics simulated_statistics(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                                     int repeats) {
  std::vector<RobotSums> all;
  const std::size_t scenes = target.scenes().size();
  std::vector<std::vector<RobotSums>> sums(scenes * static_cast<std::size_t>(repeats));
  in_parallel(sums.size(), [&](std::size_t i) {
    const FloorRun run = simulate(target.scenes()[i % scenes], target.floor(), settings.model, settings.times,
                                  settings.radio, seed * 100 + i);
    sums[i] = robot_sums(run, target.floor());
  });
  for (std::vector<RobotSums>& run : sums)
    all.insert(all.end(), std::make_move_iterator(run.begin()), std::make_move_iterator(run.end()));
  return statistics_of(all);
}

double fit(FloorModel& model, const FloorTarget& target, int rounds, double width, bool with_rim,
           std::uint64_t seed, const FloorProgress& progress) {
  const std::vector<FloorParameter> parameters = model.parameters();
  const std::vector<bool> all(parameters.size(), true);
  model.later = target.later();
  FloorStatistics at = simulated_statistics(target, model.settings(), seed * 7 + 1);
  double misfit = target.misfit(at);
  for (int round = 0; round < rounds; ++round) {
    const Surrogate surrogate = explore(model, target, all, width, seed * 10 + static_cast<std::uint64_t>(round));
    const Eigen::VectorXd steps = best_steps(surrogate, all, 1.5);
    const FloorModel before = model;
    model.values = moved(parameters, before.values, {steps.data(), steps.data() + steps.size()}, width);
    if (with_rim) update_rim(model, target, at);
    const FloorStatistics there =
        simulated_statistics(target, model.settings(), seed * 7 + 2 + static_cast<std::uint64_t>(round));
    const double now = target.misfit(there);
    progress(fmt::format("misfit {:.0f} -> {:.0f} of {} statistics", misfit, now, target.size()));
    // A step that leads away was too long for the surrogate.
    if (now > 1.05 * misfit) {
      model = before;
      width *= 0.5;
      continue;
    }
    misfit = now;
    at = there;
    width *= 0.75;
  }
  return misfit;
}

std::vector<CandidateScore> choose(const FloorModel& model, const std::vector<FloorTerm>& candidates,
                                   const FloorTarget& target, double least_gain, std::uint64_t seed,
                                   const FloorProgress& progress) {
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
  const Surrogate surrogate = explore(all, target, moves, 1, seed);
  std::vector<CandidateScore> chosen;
  std::vector<bool> taken(candidates.size(), false);
  double without = expected(surrogate, best_steps(surrogate, in_use, 1));
  while (chosen.size() < candidates.size()) {
    CandidateScore best{candidates.size(), 0, {}};
    std::string tried;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (taken[c]) continue;
      const std::size_t first = all.first_of(model.terms.size() + c), count = candidates[c].parameters.size();
      std::vector<bool> with = in_use;
      std::fill_n(with.begin() + static_cast<std::ptrdiff_t>(first), count, true);
      const Eigen::VectorXd steps = best_steps(surrogate, with, 1);
      const double gain = without - expected(surrogate, steps);
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

#include "clients/identify/kilogrid/floor_target.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "clients/identify/kilogrid/fast_swarm.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Smallest relative tolerance of a statistic: program, cells and walls are idealised.
constexpr double kExact = 0.02;
/// Bound of the mean squared distance of an unlike run. Seven of eight measured days have 0.3 to 2, one has 3.5;
/// runs of one model have less than 1.
constexpr double kUnlike = 3;
constexpr std::size_t kFewestToCompare = 4;

/// Polling order of modules, from transitions between successive reports of two cells of a module. Without an
/// order, both directions are equally frequent.
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
  // Neighbouring pairs are 01, 23 along x and 02, 13 along y; diagonal pairs are 12 and 03.
  const double by_1 = count[0][1] + count[2][3], by_3 = count[1][0] + count[3][2];
  const double by_2 = (count[0][2] + count[2][0] + count[1][3] + count[3][1]) / 2;
  const double all = by_1 + by_2 + by_3;
  if (!(all > 0)) return {0.25, 0.25, 0.25, 0.25};
  return {0.25, 0.75 * by_1 / all, 0.75 * by_2 / all, 0.75 * by_3 / all};
}

struct Unlike {
  double square, others;
};

/// Squared distance of a run's statistic from the mean of the others, relative to the spread between runs and
/// between robots.
Unlike unlike_of(const std::vector<FloorStatistics>& runs, std::size_t run, std::size_t s) {
  double sum = 0, squares = 0, count = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r == run || !std::isfinite(runs[r].value[s])) continue;
    sum += runs[r].value[s];
    squares += runs[r].value[s] * runs[r].value[s];
    ++count;
  }
  if (count < 3) return {std::numeric_limits<double>::quiet_NaN(), 0};
  const double mean = sum / count, variance = std::max(squares - sum * mean, 0.0) / (count - 1);
  const double off = runs[run].value[s] - mean;
  return {off * off / (variance * (1 + 1 / count) + runs[run].variance[s] + kExact * kExact * mean * mean), mean};
}

std::vector<std::vector<RobotSums>> sums_of(const std::vector<FloorRun>& runs, const Floor& floor) {
  std::vector<std::vector<RobotSums>> sums;
  for (const FloorRun& run : runs) sums.push_back(robot_sums(run, floor));
  return sums;
}

}  // namespace

std::vector<UnlikeRun> unlike_runs(const std::vector<FloorRun>& runs, const Floor& floor) {
  std::vector<FloorStatistics> each;
  for (const FloorRun& run : runs) each.push_back(statistics_of(robot_sums(run, floor)));
  std::vector<UnlikeRun> unlike;
  if (runs.size() < kFewestToCompare) return unlike;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    double all = 0, count = 0, worst = 0;
    UnlikeRun run{r, 0, "", 0, 0};
    for (const StatisticGroup& group : statistic_groups()) {
      double sum = 0, own = 0;
      for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
        const Unlike of = unlike_of(each, r, s);
        if (!std::isfinite(of.square)) continue;
        sum += of.square;
        ++own;
        if (of.square <= worst) continue;
        worst = of.square;
        run.worst = group.name + ", " + group.labels[s - group.first];
        run.value = each[r].value[s];
        run.others = of.others;
      }
      all += sum;
      count += own;
    }
    run.distance = all / std::max(count, 1.0);
    if (run.distance > kUnlike) unlike.push_back(std::move(run));
  }
  return unlike;
}

FloorSet::FloorSet(std::vector<std::vector<RobotSums>> sums) : runs(std::move(sums)) {
  std::vector<FloorStatistics> each;
  for (const std::vector<RobotSums>& run : runs) each.push_back(statistics_of(run));
  statistics = pooled(runs);
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    const double mean = statistics.value[s];
    double spread = 0, count = 0;
    for (const FloorStatistics& run : each) {
      if (!std::isfinite(run.value[s])) continue;
      spread += (run.value[s] - mean) * (run.value[s] - mean);
      ++count;
    }
    const double between = count > 1 ? spread / (count - 1) / count : 0;
    tolerance.push_back(std::max(statistics.variance[s], between) + kExact * kExact * mean * mean);
  }
}

double FloorSet::misfit(const FloorStatistics& simulated, const StatisticGroup& group) const {
  double sum = 0;
  for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
    const double off = simulated.value[s] - statistics.value[s];
    const double variance = tolerance[s] + simulated.variance[s];
    if (std::isfinite(off) && variance > 0) sum += off * off / variance;
  }
  return sum;
}

double FloorSet::misfit(const FloorStatistics& simulated) const {
  double sum = 0;
  for (const StatisticGroup& group : statistic_groups()) sum += misfit(simulated, group);
  return sum;
}

FloorTarget::FloorTarget(const std::vector<FloorRun>& runs, const Floor& floor, std::uint32_t threads)
    : floor_(floor),
      threads_(threads),
      runs_(runs),
      set_(sums_of(runs, floor)),
      later_(order_of_listening(runs, floor)) {
  for (std::size_t i = 0; i < runs.size(); ++i) scenes_.push_back(scene_of(runs[i], floor, i + 1));
}

FloorTarget FloorTarget::cut(double longest_s) const {
  std::vector<FloorRun> begun;
  for (const FloorRun& run : runs_) {
    FloorRun& begin = begun.emplace_back(FloorRun{run.name, std::min(run.duration_s, longest_s), {}, {}});
    for (FloorTrack track : run.tracks) {
      const auto end = std::lower_bound(track.time_s.begin(), track.time_s.end(), longest_s) - track.time_s.begin();
      const auto reports = static_cast<std::size_t>(end);
      track.time_s.resize(reports);
      track.x_mm.resize(reports);
      track.y_mm.resize(reports);
      if (reports > 1) begin.tracks.push_back(std::move(track));
    }
  }
  return FloorTarget(begun, floor_, threads_);
}

std::size_t FloorTarget::size() const {
  return static_cast<std::size_t>(
      std::count_if(tolerance().begin(), tolerance().end(), [](double t) { return t > 0; }));
}

std::vector<FloorRun> simulate_scenes(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                                      int repeats) {
  const std::size_t scenes = target.scenes().size();
  std::vector<FloorRun> runs(scenes * static_cast<std::size_t>(repeats));
  os::in_parallel(runs.size(), target.threads(), [&](std::size_t i) {
    runs[i] = simulate(target.scenes()[i % scenes], target.floor(), settings.model, settings.times, settings.radio,
                       seed * 100 + i);
  });
  return runs;
}

std::vector<std::vector<RobotSums>> simulated_sums(const FloorTarget& target, const FloorSettings& settings,
                                                   std::uint64_t seed, int repeats, Simulator by) {
  const std::size_t scenes = target.scenes().size();
  std::vector<std::vector<RobotSums>> sums(scenes * static_cast<std::size_t>(repeats));
  os::in_parallel(sums.size(), target.threads(), [&](std::size_t i) {
    const FloorScene& scene = target.scenes()[i % scenes];
    const FloorRun run = by == Simulator::kQuick ? simulate_fast(scene, target.floor(), settings, seed * 100 + i)
                                                 : simulate(scene, target.floor(), settings.model, settings.times,
                                                            settings.radio, seed * 100 + i);
    sums[i] = robot_sums(run, target.floor());
  });
  return sums;
}

FloorStatistics pooled(const std::vector<std::vector<RobotSums>>& runs,
                       const std::function<bool(std::size_t run)>& in) {
  std::vector<RobotSums> all;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!in || in(i)) all.insert(all.end(), runs[i].begin(), runs[i].end());
  }
  return statistics_of(all);
}

FloorStatistics simulated_statistics(const FloorTarget& target, const FloorSettings& settings, std::uint64_t seed,
                                     int repeats, Simulator by) {
  return pooled(simulated_sums(target, settings, seed, repeats, by));
}

}  // namespace kilotwin::kilogrid

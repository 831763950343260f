#include "clients/tune/tuner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <random>
#include <utility>

#include "core/stats/moments.hpp"

namespace kilotwin::tune {
namespace {

/// Points of the search that are measured again, besides the centre of the last generation.
constexpr std::size_t kFinalists = 3;
/// Measurements of each of them, and of the winner once more, in multiples of Settings::seeds.
constexpr std::size_t kAgain = 2, kLast = 4;
/// First step of the search: standard deviation in the unit cube. Hansen advises 0.3 of the range.
constexpr double kFirstStep = 0.3;
/// The search ends where its points lie closer than this in the unit cube.
constexpr double kSmallestStep = 1e-4;

std::size_t population_of(const Settings& s) {
  // Hansen's default, and pagmo's least.
  return std::max<std::size_t>(5, 4 + static_cast<std::size_t>(3 * std::log(static_cast<double>(s.parameters))));
}

std::size_t check_of(const Settings& s) { return s.seeds * (kAgain * (kFinalists + 1) + kLast); }

/// Measurements do not share seeds between generations, nor between search and check.
std::uint64_t first_seed(const Settings& s, std::size_t generation) { return s.seed + generation * s.seeds; }
std::uint64_t again_seed(const Settings& s) { return s.seed + s.budget; }

struct Stopped {};

/// The search as pagmo calls it. All copies share one.
class Search {
 public:
  Search(const Measure& measure, const Settings& settings) : measure_(measure), settings_(settings) {}

  double loss(const Point& point) {
    if (settings_.stop && settings_.stop()) throw Stopped();
    const std::vector<double> values = measure_(point, first_seed(settings_, generation), settings_.seeds);
    const Estimate e = estimate(values);
    Trial& trial = trials.emplace_back();
    trial.point = point;
    trial.generation = generation;
    trial.failed = values.size() - e.count;
    trial.mean = e.count > 0 ? e.mean : std::nan("");
    trial.standard_error = e.standard_error;
    if (trial.failed > 0) return worst_;  // a point whose runs fail at times is no solution
    worst_ = std::max(worst_, -e.mean + 1);
    return -e.mean;
  }

  std::vector<Trial> trials;
  std::size_t generation = 0;

 private:
  const Measure& measure_;
  const Settings& settings_;
  double worst_ = 1e30;
};

struct Problem {
  [[nodiscard]] pagmo::vector_double fitness(const pagmo::vector_double& x) const { return {search->loss(x)}; }
  [[nodiscard]] std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(parameters, 0.0), pagmo::vector_double(parameters, 1.0)};
  }
  [[nodiscard]] pagmo::thread_safety get_thread_safety() const { return pagmo::thread_safety::none; }
  Search* search = nullptr;
  std::size_t parameters = 1;
};

/// Points that cover the cube evenly (McKay 1979), the first one in its middle.
std::vector<Point> first_points(const Settings& s) {
  const std::size_t count = population_of(s);
  std::mt19937_64 random(s.seed);
  std::vector<Point> points(count, Point(s.parameters, 0.5));
  std::vector<std::size_t> cell(count - 1);
  for (std::size_t d = 0; d < s.parameters; ++d) {
    std::iota(cell.begin(), cell.end(), 0);
    std::shuffle(cell.begin(), cell.end(), random);
    for (std::size_t i = 0; i + 1 < count; ++i)
      points[i + 1][d] = (static_cast<double>(cell[i]) + 0.5) / static_cast<double>(count - 1);
  }
  return points;
}

/// The centre of the last generation that is whole: with noise it is better than any of its points.
Point centre_of_last(const std::vector<Trial>& trials) {
  Point centre(trials.back().point.size(), 0);
  std::size_t count = 0;
  for (const Trial& trial : trials) {
    if (trial.generation != trials.back().generation) continue;
    for (std::size_t d = 0; d < centre.size(); ++d) centre[d] += trial.point[d];
    ++count;
  }
  for (double& x : centre) x /= static_cast<double>(count);
  return centre;
}

std::vector<Point> finalists(std::vector<Trial> trials) {
  const Point centre = centre_of_last(trials);
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) {
    return std::pair(a.failed, -a.mean) < std::pair(b.failed, -b.mean);
  });
  std::vector<Point> points{centre};
  for (const Trial& trial : trials) {
    if (points.size() > kFinalists) break;
    if (std::isfinite(trial.mean) && std::find(points.begin(), points.end(), trial.point) == points.end())
      points.push_back(trial.point);
  }
  return points;
}

void run_search(Search& search, const Settings& s) {
  pagmo::population population{Problem{&search, s.parameters}, 0, static_cast<unsigned>(s.seed)};
  for (const Point& point : first_points(s)) population.push_back(point);
  if (std::all_of(search.trials.begin(), search.trials.end(),
                  [&](const Trial& trial) { return trial.failed == s.seeds; }))
    throw FailedSearch("no run of the first points succeeded");
  const pagmo::cmaes cmaes(1, -1, -1, -1, -1, kFirstStep, 0, kSmallestStep, true, true,
                           static_cast<unsigned>(s.seed));
  const std::size_t of_search = s.budget - check_of(s);
  while ((search.trials.size() + population.size()) * s.seeds <= of_search) {
    ++search.generation;
    const std::size_t before = search.trials.size();
    population = cmaes.evolve(population);
    if (search.trials.size() == before) break;  // its steps are small enough
  }
}

}  // namespace

std::size_t least_budget(const Settings& s) { return check_of(s) + 2 * population_of(s) * s.seeds; }

Seeds last_seeds(const Settings& s) { return {again_seed(s) + kAgain * s.seeds, kLast * s.seeds}; }

Estimate estimate(const std::vector<double>& values) {
  stats::Moments finite;
  for (const double value : values)
    if (std::isfinite(value)) finite.add(value);
  Estimate e;
  e.count = finite.count();
  e.mean = finite.mean();
  e.standard_error = finite.standard_error();
  return e;
}

Estimate difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> values;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) values.push_back(a[i] - b[i]);
  return estimate(values);
}

Tuned tune(const Measure& measure, const Settings& s) {
  if (s.parameters == 0 || s.seeds < 2 || s.budget < least_budget(s))
    throw std::invalid_argument("tune: no parameter, fewer than two seeds, or too small a budget");
  Tuned tuned;
  Search search(measure, s);
  try {
    run_search(search, s);
  } catch (const Stopped&) {
    tuned.stopped = true;
  }
  tuned.trials = std::move(search.trials);
  if (tuned.stopped) return tuned;
  for (const Point& point : finalists(tuned.trials)) {
    if (s.stop && s.stop()) {
      tuned.stopped = true;
      tuned.again.clear();
      return tuned;
    }
    const std::vector<double> values = measure(point, again_seed(s), kAgain * s.seeds);
    const Estimate e = estimate(values);
    tuned.again.push_back({point, search.generation,
                           e.count > 0 ? e.mean : -std::numeric_limits<double>::infinity(), e.standard_error,
                           values.size() - e.count});
  }
  std::stable_sort(tuned.again.begin(), tuned.again.end(), [](const Trial& a, const Trial& b) {
    return std::pair(a.failed, -a.mean) < std::pair(b.failed, -b.mean);
  });
  tuned.best = tuned.again.front().point;
  const Seeds last = last_seeds(s);
  tuned.last = measure(tuned.best, last.first, last.count);
  tuned.value = estimate(tuned.last);
  return tuned;
}

}  // namespace kilotwin::tune

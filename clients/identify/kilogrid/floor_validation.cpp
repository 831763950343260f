#include "clients/identify/kilogrid/floor_validation.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/kilogrid/floor_classifier.hpp"
#include "clients/identify/result/values.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::kilogrid {
namespace {

/// Robots per held-out run with predictions. With 24, a difference of models of some 3 % of the error is beyond chance; the errors of
/// six said hardly more than which six they were.
constexpr std::size_t kPredictedRobots = 24;
/// The mean of N particles that lie s apart has an error of s / sqrt(N), which adds to that of the model: 0.5 % of its square here.
constexpr std::size_t kParticles = 200;
constexpr double kPredicted_s = 900;

/// A robot whose cells are predicted, and its results.
struct PredictedRobot {
  const FloorRun* run;
  std::size_t place;  ///< in the run
  std::uint32_t robot = 0;
  CellFilterResult result = {};
};

/// Mean area with its standard error.
struct MeanArea {
  double sum = 0, variance = 0, count = 0;
  void add(const ClassifierResult& t) {
    sum += t.best();
    variance += t.best_sd() * t.best_sd();
    ++count;
  }
  [[nodiscard]] double value() const { return count > 0 ? sum / count : 0.5; }
  [[nodiscard]] double sd() const { return count > 0 ? std::sqrt(variance) / count : 0; }
  [[nodiscard]] identification::Area area() const {
    identification::Area out;
    out.set_area(value());
    out.set_low(value() - stats::kNormal95 * sd());
    out.set_high(value() + stats::kNormal95 * sd());
    out.set_pairs(count);
    return out;
  }
};

double area_of_feature(const std::vector<TrackWindow>& a, const std::vector<TrackWindow>& b, std::size_t feature) {
  std::vector<double> of_a, of_b;
  for (const TrackWindow& w : a) of_a.push_back(w.feature[feature]);
  for (const TrackWindow& w : b) of_b.push_back(w.feature[feature]);
  return area_under_curve(of_a, of_b);
}

/// Mean over held-out runs, each against its simulation.
double mean_area_of_feature(const std::vector<std::vector<TrackWindow>>& measured,
                            const std::vector<std::vector<TrackWindow>>& simulated, std::size_t feature) {
  double mean = 0;
  for (std::size_t i = 0; i < simulated.size(); ++i)
    mean += area_of_feature(measured[i], simulated[i], feature) / static_cast<double>(simulated.size());
  return mean;
}

}  // namespace

Validation validate(const std::vector<FloorRun>& runs, const Floor& floor, const FloorSettings& settings,
                    double horizon_s, std::uint32_t threads, std::vector<Predicted>* all) {
  std::vector<PredictedRobot> robots;
  for (const FloorRun& run : runs) {
    const std::size_t stride = std::max<std::size_t>(run.tracks.size() / kPredictedRobots, 1);
    for (std::size_t i = stride / 2; i < run.tracks.size(); i += stride) robots.push_back({&run, i});
  }
  os::in_parallel(robots.size(), threads, [&](std::size_t r) {
    FloorTrack track = robots[r].run->tracks[robots[r].place];
    while (track.size() > 1 && track.time_s.back() > kPredicted_s) {
      track.time_s.pop_back();
      track.x_mm.pop_back();
      track.y_mm.pop_back();
    }
    robots[r].robot = track.robot;
    robots[r].result = filter_cells(track, floor, settings, horizon_s, kParticles, 17 * robots[r].place + 5);
  });
  Validation judged;
  for (const PredictedRobot& of : robots) {
    judged.log_likelihood += of.result.log_likelihood;
    judged.reports += of.result.reports;
    double sum = 0;
    for (const CellPrediction& p : of.result.predictions) {
      const double dx = p.x_mm - p.measured_x_mm, dy = p.y_mm - p.measured_y_mm;
      sum += dx * dx + dy * dy;
      if (all != nullptr) all->push_back({of.run->name, of.robot, p});
    }
    judged.sum += sum;
    judged.rows += of.result.predictions.size();
    judged.by_robot.emplace_back(sum, static_cast<double>(of.result.predictions.size()));
  }
  return judged;
}

Excess excess_of(const Validation& a, const Validation& b) {
  if (a.by_robot.size() != b.by_robot.size() || a.rows == 0) return {INFINITY, 0};
  const auto n = static_cast<double>(a.rows);
  const double mean = (a.sum - b.sum) / n;
  double spread = 0;
  for (std::size_t r = 0; r < a.by_robot.size(); ++r) {
    const double d = a.by_robot[r].first - b.by_robot[r].first - mean * a.by_robot[r].second;
    spread += d * d;
  }
  // The mean is of the same robots. One robot says nothing about the spread: no excess passes as chance.
  const auto robots = static_cast<double>(a.by_robot.size());
  return {mean, robots < 2 ? 0 : std::sqrt(spread * robots / (robots - 1)) / n};
}

identification::Accuracy accuracy_of(const Validation& judged) {
  const auto n = static_cast<double>(std::max<std::size_t>(judged.rows, 1));
  const double mean = judged.sum / n;
  double spread = 0;
  for (const auto& [sum, count] : judged.by_robot) spread += (sum - mean * count) * (sum - mean * count);
  const double half = stats::kNormal95 * std::sqrt(spread) / n;
  identification::Accuracy out;
  *out.mutable_rmse_mm() = identify::json_value(judged.rmse_mm());
  out.set_rmse_low_mm(std::sqrt(std::max(mean - half, 0.0)));
  out.set_rmse_high_mm(std::sqrt(mean + half));
  out.set_rows(static_cast<std::uint32_t>(judged.rows));
  out.set_log_likelihood_per_report(judged.log_likelihood /
                                    static_cast<double>(std::max<std::size_t>(judged.reports, 1)));
  return out;
}

identification::Classifier classify(const std::vector<FloorRun>& alike, const std::vector<FloorRun>& unlike,
                                    const std::vector<FloorRun>& test, const FloorTarget& held_out,
                                    const FloorSettings& before, const FloorSettings& after) {
  const Floor& floor = held_out.floor();
  std::vector<std::vector<TrackWindow>> measured, by_before, by_after;
  for (const auto* runs : {&test, &alike, &unlike}) {
    for (const FloorRun& run : *runs) measured.push_back(windows_of(run, floor));
  }
  for (const FloorRun& run : simulate_scenes(held_out, before, 901)) by_before.push_back(windows_of(run, floor));
  for (const FloorRun& run : simulate_scenes(held_out, after, 902)) by_after.push_back(windows_of(run, floor));

  // Pairs of measured runs first, then each held-out run with its simulation.
  struct Pair {
    const std::vector<TrackWindow>*a, *b;
    ClassifierResult result = {};
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    for (std::size_t j = i + 1; j < measured.size(); ++j) pairs.push_back({&measured[i], &measured[j]});
  }
  const std::size_t days = pairs.size(), runs = test.size();
  for (std::size_t i = 0; i < runs; ++i) pairs.push_back({&measured[i], &by_before[i]});
  for (std::size_t i = 0; i < runs; ++i) pairs.push_back({&measured[i], &by_after[i]});
  os::in_parallel(pairs.size(), held_out.threads(),
                  [&](std::size_t i) { pairs[i].result = classifier_test(*pairs[i].a, *pairs[i].b); });

  identification::Classifier out;
  MeanArea all_days, days_alike, mean_before, mean_after;
  const std::size_t like_others = runs + alike.size();
  for (std::size_t i = 0, p = 0; i < measured.size(); ++i) {
    for (std::size_t j = i + 1; j < measured.size(); ++j, ++p) {
      all_days.add(pairs[p].result);
      if (i < runs && j < like_others) days_alike.add(pairs[p].result);
    }
  }
  for (std::size_t i = 0; i < runs; ++i) {
    const ClassifierResult &b = pairs[days + i].result, &a = pairs[days + runs + i].result;
    mean_before.add(b);
    mean_after.add(a);
    identification::ClassifiedRun& run = *out.add_runs();
    run.set_run(test[i].name);
    run.set_before(b.best());
    run.set_after(a.best());
    run.set_after_logistic(a.logistic);
    run.set_after_boosted(a.boosted);
    run.set_after_se(a.best_sd());
  }
  *out.mutable_measured_days() = all_days.area();
  *out.mutable_measured_days_held_out() = days_alike.area();
  *out.mutable_before() = mean_before.area();
  *out.mutable_after() = mean_after.area();
  out.set_above_measured_days(mean_after.value() - all_days.value());
  out.set_above_measured_days_se(std::hypot(mean_after.sd(), all_days.sd()));
  for (std::size_t f = 0; f < feature_names().size(); ++f) {
    identification::ClassifierFeature& feature = *out.add_features();
    feature.set_name(feature_names()[f]);
    feature.set_before(mean_area_of_feature(measured, by_before, f));
    feature.set_after(mean_area_of_feature(measured, by_after, f));
  }
  return out;
}

}  // namespace kilotwin::kilogrid

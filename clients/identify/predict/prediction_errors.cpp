#include "clients/identify/predict/prediction_errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/random/random.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/quantiles.hpp"
#include "core/stats/resampling.hpp"

namespace kilotwin::identify {
namespace {

/// Bootstrap draws; more make the ends of intervals less random, and cost time in proportion.
constexpr std::int64_t kDraws = 2000;

double root_mean(double sum, std::size_t rows) { return rows > 0 ? std::sqrt(sum / static_cast<double>(rows)) : 0; }

Interval middle_95(std::vector<double> values) {
  return {stats::nearest_quantile(values, 0.025), stats::nearest_quantile(values, 0.975)};
}

std::vector<double> drawn(const Random& random, std::size_t count, std::int64_t k, std::uint32_t what) {
  return stats::bootstrap_weights(count, [&](std::size_t i) {
    const double u = random.uniform(Stream::kLayout, static_cast<std::uint32_t>(i), Tick{k}, what);
    return std::min(count - 1, static_cast<std::size_t>(u * static_cast<double>(count)));
  });
}

/// The error of one prediction, in the body frame at its start.
struct Window {
  const Track* track;
  double ahead_mm, left_mm;
};

/// Whether two robots had the same commands in a time interval, up to small shifts of the changes.
bool same_commands(const Track& a, const Track& b, double from_s, double to_s) {
  // Shift of a change; a larger value groups windows of different motion, a smaller one fewer windows.
  constexpr double kApart_s = 0.25;
  const auto changes = [&](const Track& track) {
    std::vector<CommandChange> out;
    for (std::size_t c = 0; c < track.commands.size(); ++c) {
      const CommandChange& change = track.commands[c];
      const bool last_before = c + 1 == track.commands.size() || track.commands[c + 1].time_s > from_s;
      if (change.time_s <= from_s && last_before) out.push_back({from_s, change.motion});
      if (change.time_s > from_s && change.time_s < to_s) out.push_back(change);
    }
    return out;
  };
  const std::vector<CommandChange> first = changes(a), second = changes(b);
  return std::equal(first.begin(), first.end(), second.begin(), second.end(),
                    [](const CommandChange& x, const CommandChange& y) {
                      return x.motion == y.motion && std::abs(x.time_s - y.time_s) < kApart_s;
                    });
}

}  // namespace

double PredictionErrors::rmse_mm() const { return root_mean(sum_mm2, rows); }
double PredictionErrors::expected_mm() const { return root_mean(expected_mm2, rows); }

PredictionErrors errors_of(const MeasuredSet& set, const std::vector<Forecast>& predictions) {
  PredictionErrors errors;
  for (const Forecast& p : predictions) {
    const std::optional<Eigen::Vector2d> error_mm = error_of(set.runs[p.run].tracks[p.place], p);
    if (!error_mm) continue;
    const double square = error_mm->squaredNorm();
    auto& track = errors.by_track[{p.run, p.place}];
    track.sum_mm2 += square;
    track.rows += 1;
    errors.sum_mm2 += square;
    errors.expected_mm2 += p.expected_error_mm * p.expected_error_mm;
    ++errors.rows;
  }
  return errors;
}

std::optional<ErrorBounds> bounds_of(const MeasuredSet& set, const PredictionErrors& before,
                                     const PredictionErrors& after) {
  struct Row {
    std::size_t robot, run;
    double before_mm2, after_mm2, count;
  };
  std::map<std::size_t, std::size_t> robot_place, run_place;
  std::vector<Row> rows;
  for (const auto& [track, part] : before.by_track) {
    const auto other = after.by_track.find(track);
    if (other == after.by_track.end() || other->second.rows != part.rows) continue;
    const std::size_t robot = set.runs[track.first].tracks[track.second].robot;
    const std::size_t r = robot_place.emplace(robot, robot_place.size()).first->second;
    const std::size_t n = run_place.emplace(track.first, run_place.size()).first->second;
    rows.push_back({r, n, part.sum_mm2, other->second.sum_mm2, static_cast<double>(part.rows)});
  }
  if (rows.size() < 2) return std::nullopt;
  const Random random(20180729);
  std::vector<double> was, is, less;
  for (std::int64_t k = 0; k < kDraws; ++k) {
    const std::vector<double> of_robot = drawn(random, robot_place.size(), k, 0),
                              of_run = drawn(random, run_place.size(), k, 1);
    double count = 0, sum_before = 0, sum_after = 0;
    for (const Row& row : rows) {
      const double times = of_robot[row.robot] * of_run[row.run];
      count += times * row.count;
      sum_before += times * row.before_mm2;
      sum_after += times * row.after_mm2;
    }
    if (!(count > 0)) continue;
    was.push_back(std::sqrt(sum_before / count));
    is.push_back(std::sqrt(sum_after / count));
    less.push_back(was.back() - is.back());
  }
  if (was.size() < 100) return std::nullopt;
  return ErrorBounds{middle_95(was), middle_95(is), middle_95(less), robot_place.size(), run_place.size()};
}

std::optional<StretchBounds> bounds_of(const std::vector<Stretch>& stretches) {
  constexpr std::size_t kFewest = 6;  // stretches; with fewer, the errors get no interval from them
  if (stretches.size() < kFewest) return std::nullopt;
  const Random random(20180729);
  const auto count = static_cast<double>(stretches.size());
  const double wider = stats::student_quantile(0.975, count - 1) / stats::student_quantile(0.975, 1e6) *
                       std::sqrt(count / (count - 1));
  std::vector<double> error, less;
  for (std::int64_t k = 0; k < kDraws; ++k) {
    const std::vector<double> times = drawn(random, stretches.size(), k, 2);
    Stretch sum;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      sum.before_mm2 += times[i] * stretches[i].before_mm2;
      sum.after_mm2 += times[i] * stretches[i].after_mm2;
      sum.rows += times[i] * stretches[i].rows;
    }
    error.push_back(std::sqrt(sum.before_mm2 / sum.rows));
    less.push_back(error.back() - std::sqrt(sum.after_mm2 / sum.rows));
  }
  const auto interval = [&](std::vector<double>& values) {
    const Interval middle = middle_95(values);
    const double centre_mm = stats::interpolated_quantile(values, 0.5);
    return Interval{centre_mm - wider * (centre_mm - middle.low_mm),
                    centre_mm + wider * (middle.high_mm - centre_mm)};
  };
  return StretchBounds{interval(error), interval(less)};
}

std::optional<Replicates> replicates_of(
    const std::vector<std::pair<const MeasuredSet*, const std::vector<Forecast>*>>& sets, double horizon_s) {
  // Degrees of freedom; with fewer, the spread of repeated motion is too uncertain to be stated.
  constexpr std::size_t kFewest = 30;
  // By robot and time, ms.
  std::map<std::pair<std::uint32_t, std::int64_t>, std::vector<Window>> at;
  for (const auto& [set, predictions] : sets) {
    for (const Forecast& p : *predictions) {
      const Track& track = set->runs[p.run].tracks[p.place];
      const std::optional<Eigen::Vector2d> error_mm = error_of(track, p);
      const Sample* const start = sample_near(track, p.time_s - horizon_s, kNear * horizon_s);
      if (!error_mm || start == nullptr) continue;
      // A rough heading suffices: it rotates the error, not the path.
      const double heading = std::isnan(start->heading_rad) ? std::atan2(p.y_mm - start->y_mm, p.x_mm - start->x_mm)
                                                            : start->heading_rad;
      const double dx = error_mm->x(), dy = error_mm->y(), c = std::cos(heading), s = std::sin(heading);
      at[{track.robot, std::llround(p.time_s * 1000)}].push_back({&track, dx * c + dy * s, dy * c - dx * s});
    }
  }
  Replicates out;
  double within_mm2 = 0, all_mm2 = 0;
  std::size_t degrees = 0;
  for (auto& [key, windows] : at) {
    const double time_s = static_cast<double>(key.second) / 1000;
    while (windows.size() > 1) {
      // Groups the windows that share the first window's commands.
      const Track& first = *windows.front().track;
      const auto rest = std::stable_partition(windows.begin(), windows.end(), [&](const Window& w) {
        return same_commands(first, *w.track, time_s - horizon_s, time_s);
      });
      const auto count = static_cast<double>(rest - windows.begin());
      double ahead = 0, left = 0, square = 0;
      for (auto w = windows.begin(); w != rest; ++w) {
        ahead += w->ahead_mm / count;
        left += w->left_mm / count;
        square += w->ahead_mm * w->ahead_mm + w->left_mm * w->left_mm;
      }
      if (count > 1) {
        within_mm2 += square - count * (ahead * ahead + left * left);
        all_mm2 += square;
        degrees += static_cast<std::size_t>(count) - 1;
        out.windows += static_cast<std::size_t>(count);
        ++out.groups;
      }
      windows.erase(windows.begin(), rest);
    }
  }
  if (degrees < kFewest) return std::nullopt;
  const double floor_mm2 = within_mm2 / static_cast<double>(degrees);
  out.floor_mm = std::sqrt(std::max(0.0, floor_mm2));
  out.repeatable_mm = std::sqrt(std::max(0.0, all_mm2 / static_cast<double>(out.windows) - floor_mm2));
  return out;
}

}  // namespace kilotwin::identify

#include "clients/identify/replay/track_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "clients/identify/model/covariates.hpp"
#include "core/random/random.hpp"
#include "core/stats/quantiles.hpp"
#include "core/stats/resampling.hpp"

namespace kilotwin::identify {
namespace {

/// Bins of a histogram, and of the time of a run. More show finer differences, from fewer samples each.
constexpr std::size_t kBins = 36, kTimeBins = 12;
constexpr double kWallBins_mm = 20;  // width of the bins; finer ones have fewer samples each
/// A robot this close to a wall counts as at the wall, mm.
constexpr double kAtWall_mm = 8;
/// Without headings, a turn is measured between two displacements longer than this, mm.
constexpr double kShortestWay_mm = 6;
constexpr std::uint32_t kExchanges = 999;
constexpr std::size_t kWindowsPerLag = 40;

std::vector<double> edges(double low, double high, std::size_t bins) {
  std::vector<double> out(bins + 1);
  for (std::size_t i = 0; i <= bins; ++i)
    out[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(bins);
  return out;
}

/// Values beyond the edges count in the outermost bins.
void count(const Statistic& statistic, Tally& tally, double value) {
  const auto n = static_cast<double>(statistic.bins());
  const double part = (value - statistic.at.front()) / (statistic.at.back() - statistic.at.front()) * n;
  tally.weight[static_cast<std::size_t>(std::clamp(part, 0.0, n - 1))] += 1;
}

void average(Tally& tally, std::size_t bin, double value) {
  tally.sum[bin] += value;
  tally.weight[bin] += 1;
}

}  // namespace

void Tally::add(const Tally& other) {
  for (std::size_t i = 0; i < weight.size(); ++i) {
    sum[i] += other.sum[i];
    weight[i] += other.weight[i];
  }
}

void Tally::scale(double by) {
  for (double& s : sum) s *= by;
  for (double& w : weight) w *= by;
}

double Tally::total() const { return std::accumulate(weight.begin(), weight.end(), 0.0); }

template <class Speed, class Turn>
void TrackStatistics::motion_segments(const Track& track, const RunNeighbours* neighbours, std::size_t place,
                                      Speed&& speed, Turn&& turn) const {
  const std::vector<Sample>& samples = track.samples;
  const CommandClock clock(track);
  double way_rad = 0, way_end_s = -1;  // direction and end of the previous displacement if it was long enough
  for (std::size_t i = 0; i + 1 < samples.size();) {
    const Sample& from = samples[i];
    std::size_t j = i + 1;
    while (j < samples.size() && samples[j].time_s < from.time_s + segment_s_ - 0.01) ++j;
    if (j == samples.size()) break;
    const Sample& to = samples[j];
    const double change_s = clock.next_change_s(from.time_s);
    const double lasts_s = to.time_s - from.time_s;
    if (change_s < to.time_s - 1e-6) {
      // Continues with the first sample under the next command.
      while (i < samples.size() && samples[i].time_s < change_s) ++i;
      way_end_s = -1;
      continue;
    }
    i = j;
    if (!clock.at(from.time_s).driven() || lasts_s > 1.5 * segment_s_ ||
        (neighbours != nullptr && in_contact(from, to, *neighbours, place))) {
      way_end_s = -1;
      continue;
    }
    const double dx = to.x_mm - from.x_mm, dy = to.y_mm - from.y_mm, way_mm = std::sqrt(dx * dx + dy * dy);
    speed(0.5 * (from.time_s + to.time_s), way_mm / lasts_s);
    if (!std::isnan(from.heading_rad) && !std::isnan(to.heading_rad)) {
      turn(wrapped_angle(to.heading_rad - from.heading_rad) / lasts_s);
      continue;
    }
    const double direction_rad = std::atan2(dy, dx);
    if (way_mm < kShortestWay_mm) {
      way_end_s = -1;
      continue;
    }
    if (way_end_s == from.time_s) turn(wrapped_angle(direction_rad - way_rad) / lasts_s);
    way_rad = direction_rad;
    way_end_s = to.time_s;
  }
}

bool TrackStatistics::in_contact(const Sample& from, const Sample& to, const RunNeighbours& neighbours,
                                 std::size_t place) const {
  for (const Sample* s : {&from, &to})
    if (walls_.at_wall(s->x_mm, s->y_mm, kAtWall_mm + off_centre_mm_)) return true;
  const auto later = static_cast<int>((to.time_s - from.time_s) / RunNeighbours::kRaster_s);
  for (int i = 0; i <= later; ++i)
    if (neighbours.view(place, from.time_s + i * RunNeighbours::kRaster_s).nearest_mm <
        kContactRange_mm + 2 * off_centre_mm_)
      return true;
  return false;
}

double TrackStatistics::wall_distance_mm(const Sample& s) const {
  return std::max(0.0, std::min({s.x_mm - walls_.x_low_mm, walls_.x_high_mm - s.x_mm, s.y_mm - walls_.y_low_mm,
                                 walls_.y_high_mm - s.y_mm}));
}

TrackStatistics::TrackStatistics(const std::vector<const Track*>& tracks, const Walls& walls, double off_centre_mm)
    : walls_(walls),
      has_walls_(std::isfinite(walls.x_low_mm) || std::isfinite(walls.x_high_mm) || std::isfinite(walls.y_low_mm) ||
                 std::isfinite(walls.y_high_mm)),
      off_centre_mm_(off_centre_mm) {
  std::vector<double> steps;
  first_s_ = 1e300;
  last_s_ = -1e300;
  for (const Track* track : tracks) {
    for (std::size_t i = 1; i < track->samples.size(); ++i)
      steps.push_back(track->samples[i].time_s - track->samples[i - 1].time_s);
    if (track->samples.empty()) continue;
    first_s_ = std::min(first_s_, track->samples.front().time_s);
    last_s_ = std::max(last_s_, track->samples.back().time_s);
  }
  segment_s_ = std::max(segment_s_, stats::lower_quantile(steps, 0.5));
  std::vector<double> speeds, turns;
  for (const Track* track : tracks) {
    motion_segments(
        *track, nullptr, 0, [&](double, double v) { speeds.push_back(v); },
        [&](double w) { turns.push_back(std::abs(w)); });
  }
  if (speeds.size() < 10 || !(last_s_ > first_s_)) return;
  const double fastest = std::max(1.0, 1.25 * stats::lower_quantile(speeds, 0.99));
  list_.push_back({Statistic::Kind::kHistogram, "speed", "mm/s", edges(0, fastest, kBins), "mm/s"});
  if (turns.size() >= 10) {
    const double most = std::max(0.02, 1.25 * stats::lower_quantile(turns, 0.99));
    list_.push_back({Statistic::Kind::kHistogram, "turning", "rad/s", edges(-most, most, kBins), "rad/s"});
  }
  std::vector<double> middles = edges(first_s_, last_s_, kTimeBins);
  for (std::size_t i = 0; i < kTimeBins; ++i) middles[i] = 0.5 * (middles[i] + middles[i + 1]);
  middles.pop_back();
  list_.push_back({Statistic::Kind::kMeans, "mean speed over the run", "s", middles, "mm/s"});
  std::vector<double> lags;
  for (const double lag_s : {1., 2., 5., 10., 20., 50., 100., 200., 500., 1000.})
    if (lag_s >= stats::lower_quantile(steps, 0.5) * 0.99 && lag_s <= 0.5 * (last_s_ - first_s_))
      lags.push_back(lag_s);
  if (lags.size() >= 2) list_.push_back({Statistic::Kind::kSquares, "mean square displacement", "s", lags, "%"});
  if (!has_walls_) return;
  std::vector<double> from_walls;
  for (const Track* track : tracks)
    for (const Sample& s : track->samples) from_walls.push_back(wall_distance_mm(s));
  const double farthest_mm = std::max(kWallBins_mm, stats::lower_quantile(from_walls, 0.995));
  list_.push_back({Statistic::Kind::kHistogram, "distance from the walls", "mm",
                   edges(0, farthest_mm, static_cast<std::size_t>(farthest_mm / kWallBins_mm) + 1), "mm"});
  list_.push_back({Statistic::Kind::kMeans, "share of time at walls", "", {0}, ""});
}

std::vector<Tally> TrackStatistics::tally(const Track& track, const RunNeighbours& neighbours,
                                          std::size_t place) const {
  const std::vector<Sample>& samples = track.samples;
  std::vector<Tally> tallies;
  for (const Statistic& statistic : list_)
    tallies.push_back({std::vector<double>(statistic.bins()), std::vector<double>(statistic.bins())});
  const auto find = [&](std::string_view name) {
    const auto at = std::find_if(list_.begin(), list_.end(), [&](const Statistic& s) { return s.name == name; });
    return at == list_.end() ? nullptr : &tallies[static_cast<std::size_t>(at - list_.begin())];
  };
  Tally *const speed = find("speed"), *const turning = find("turning"),
               *const over_time = find("mean speed over the run"), *const msd = find("mean square displacement"),
               *const wall = find("distance from the walls"), *const at_wall = find("share of time at walls");
  const auto of = [&](const Tally* tally) -> const Statistic& {
    return list_[static_cast<std::size_t>(tally - tallies.data())];
  };
  motion_segments(
      track, &neighbours, place,
      [&](double time_s, double v) {
        if (speed != nullptr) count(of(speed), *speed, v);
        if (over_time == nullptr) return;
        const double part = (time_s - first_s_) / (last_s_ - first_s_) * kTimeBins;
        average(*over_time, static_cast<std::size_t>(std::clamp(part, 0.0, kTimeBins - 1.0)), v);
      },
      [&](double w) {
        if (turning != nullptr) count(of(turning), *turning, w);
      });
  for (std::size_t lag = 0; msd != nullptr && lag < of(msd).at.size(); ++lag) {
    const double lag_s = of(msd).at[lag];
    const std::size_t every = samples.size() / kWindowsPerLag + 1;
    for (std::size_t i = 0; i < samples.size(); i += every) {
      const auto to = std::lower_bound(samples.begin() + static_cast<std::ptrdiff_t>(i), samples.end(),
                                       samples[i].time_s + 0.95 * lag_s,
                                       [](const Sample& s, double t) { return s.time_s < t; });
      if (to == samples.end()) break;
      if (to->time_s > samples[i].time_s + 1.05 * lag_s) continue;
      const double dx = to->x_mm - samples[i].x_mm, dy = to->y_mm - samples[i].y_mm;
      average(*msd, lag, dx * dx + dy * dy);
    }
  }
  for (const Sample& s : samples) {
    if (wall == nullptr) break;
    count(of(wall), *wall, wall_distance_mm(s));
    average(*at_wall, 0, wall_distance_mm(s) < kAtWall_mm + off_centre_mm_ ? 1 : 0);
  }
  return tallies;
}

double distance(const Statistic& statistic, const Tally& a, const Tally& b) {
  const double total_a = a.total(), total_b = b.total();
  if (!(total_a > 0) || !(total_b > 0)) return 0;
  double sum = 0;
  if (statistic.kind == Statistic::Kind::kHistogram) {
    double below_a = 0, below_b = 0;
    for (std::size_t i = 0; i + 1 < a.weight.size(); ++i) {
      below_a += a.weight[i] / total_a;
      below_b += b.weight[i] / total_b;
      sum += std::abs(below_a - below_b) * (statistic.at[i + 1] - statistic.at[i]);
    }
    return sum;
  }
  double bins = 0;
  for (std::size_t i = 0; i < a.weight.size(); ++i) {
    if (!(a.weight[i] > 0) || !(b.weight[i] > 0)) continue;
    const double mean_a = a.sum[i] / a.weight[i], mean_b = b.sum[i] / b.weight[i];
    if (statistic.kind == Statistic::Kind::kMeans) {
      sum += std::abs(mean_a - mean_b);
    } else if (mean_a > 0 && mean_b > 0) {
      sum += std::abs(std::log(mean_a / mean_b));
    } else {
      continue;
    }
    bins += 1;
  }
  return bins > 0 ? sum / bins : 0;
}

Comparison compare(const Statistic& statistic, const std::vector<Tally>& measured,
                   const std::vector<std::vector<Tally>>& simulated) {
  const Random random(20180729);
  // Distance after the marked units have exchanged their labels.
  const auto permuted_distance = [&](const std::vector<bool>& exchanged) {
    double sum = 0;
    for (const std::vector<Tally>& simulation : simulated) {
      Tally a{std::vector<double>(statistic.bins()), std::vector<double>(statistic.bins())}, b = a;
      for (std::size_t u = 0; u < measured.size(); ++u) {
        (exchanged[u] ? b : a).add(measured[u]);
        (exchanged[u] ? a : b).add(simulation[u]);
      }
      sum += distance(statistic, a, b);
    }
    return simulated.empty() ? 0 : sum / static_cast<double>(simulated.size());
  };
  std::vector<bool> exchanged(measured.size(), false);
  Comparison out;
  out.distance = permuted_distance(exchanged);
  std::vector<double> null_distances;
  std::uint32_t exceedances = 0;
  for (std::uint32_t k = 0; k < kExchanges; ++k) {
    for (std::uint32_t u = 0; u < measured.size(); ++u)
      exchanged[u] = random.uniform(Stream::kLayout, u, Tick{k}, 0) < 0.5;
    null_distances.push_back(permuted_distance(exchanged));
    if (null_distances.back() >= out.distance * (1 - 1e-12)) ++exceedances;
  }
  out.by_chance_95 = stats::lower_quantile(null_distances, 0.95);
  out.p = stats::permutation_p(exceedances, kExchanges);
  return out;
}

}  // namespace kilotwin::identify

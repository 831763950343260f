#include "clients/identify/bristle/ride_model.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>

namespace kilotwin::bristle {
namespace {

constexpr double kLine_s = 0.5, kEvery_s = 1, kFirst_s = 3, kNear_s = 0.1;
constexpr std::size_t kFewest = 4;
/// Instants that a run's own values are blended with: those of all runs.
constexpr double kPrior = 6;
constexpr std::complex<double> kI(0, 1);

std::complex<double> unit(double angle_rad) { return std::exp(kI * angle_rad); }

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The line through rows first..last at `at_s`: place and slope.
std::pair<double, double> line(const std::vector<double>& t, const std::vector<double>& v, std::size_t first,
                               std::size_t last, double at_s) {
  double mean_t = 0, mean_v = 0, tt = 0, tv = 0;
  const auto n = static_cast<double>(last - first);
  for (std::size_t i = first; i < last; ++i) {
    mean_t += t[i] / n;
    mean_v += v[i] / n;
  }
  for (std::size_t i = first; i < last; ++i) {
    tt += (t[i] - mean_t) * (t[i] - mean_t);
    tv += (t[i] - mean_t) * (v[i] - mean_v);
  }
  const double slope = tt > 0 ? tv / tt : 0;
  return {mean_v + slope * (at_s - mean_t), slope};
}

double speed_of(const RideInstant& i) { return std::hypot(i.vx_mm_s, i.vy_mm_s); }

/// Values of one run so far, blended with those of all runs.
struct OwnPast {
  std::vector<double> speeds;
  std::complex<double> mount = 0, drift = 0;
  double turn = 0, turns = 0, instants = 0;
  std::complex<double> last_way = 0;
  double last_time_s = -std::numeric_limits<double>::infinity();

  void add(const RideInstant& now, const RideModel& all, const RideEffects& effects) {
    const std::complex<double> way(now.vx_mm_s, now.vy_mm_s);
    speeds.push_back(std::abs(way));
    if (speeds.size() > 20) speeds.erase(speeds.begin());
    // Twice the angle: front and back are one.
    mount += unit(2 * (std::arg(way) + now.axis_rad - all.sense_rad));
    if (now.time_s - last_time_s < 1.5 * kEvery_s) {
      const double turned = std::arg(way * std::conj(last_way));
      if (std::abs(turned) < 1.2) {
        turn += turned / (now.time_s - last_time_s);
        ++turns;
      }
    }
    last_way = way;
    last_time_s = now.time_s;
    ++instants;
    const std::complex<double> forward = direction(now, all, effects);
    const double speed = median(speeds);
    if (speed > 0) drift += (way - speed * forward) / speed;
  }
  [[nodiscard]] double own_mount() const { return std::arg(mount + kPrior) / 2; }
  [[nodiscard]] double own_turn() const { return turn / (turns + kPrior); }
  [[nodiscard]] std::complex<double> own_drift(const RideModel& all) const {
    return (drift + kPrior * std::complex<double>(all.drift_x, all.drift_y)) / (instants + kPrior);
  }
  /// Where it goes, if nothing carries it.
  [[nodiscard]] std::complex<double> direction(const RideInstant& now, const RideModel& all,
                                               const RideEffects& on) const {
    const auto has = [&](RideEffect effect) { return on[static_cast<std::size_t>(effect)]; };
    const double measured = has(RideEffect::kAxis) ? now.axis_rad : now.heading_rad;
    double heading = has(RideEffect::kSense) ? all.sense_rad - measured : measured;
    if (has(RideEffect::kMount)) heading += own_mount();
    std::complex<double> forward = unit(heading);
    const std::complex<double> way(now.vx_mm_s, now.vy_mm_s);
    if (has(RideEffect::kAxis) && (way * std::conj(forward)).real() < 0) forward = -forward;
    return forward;
  }
};

}  // namespace

std::vector<RideInstant> instants_of(const std::vector<RiddenRun>& runs, double horizon_s) {
  std::vector<RideInstant> all;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RiddenRun& run = runs[r];
    if (run.size() < 2) continue;
    for (double now_s = run.time_s.front() + kFirst_s; now_s + horizon_s < run.time_s.back(); now_s += kEvery_s) {
      const auto row = [&](double t) {
        return static_cast<std::size_t>(std::upper_bound(run.time_s.begin(), run.time_s.end(), t) -
                                        run.time_s.begin());
      };
      const std::size_t first = row(now_s - kLine_s), last = row(now_s);
      std::size_t later = row(now_s + horizon_s);
      if (later == run.size() ||
          (later > 0 && now_s + horizon_s - run.time_s[later - 1] < run.time_s[later] - now_s - horizon_s))
        --later;
      if (last < first + kFewest || std::abs(run.time_s[later] - now_s - horizon_s) > kNear_s) continue;
      std::complex<double> heading = 0, axis = 0;
      for (std::size_t i = first; i < last; ++i) {
        heading += unit(run.heading_rad[i]);
        axis += unit(2 * run.heading_rad[i]);
      }
      const auto [x, vx] = line(run.time_s, run.x_mm, first, last, now_s);
      const auto [y, vy] = line(run.time_s, run.y_mm, first, last, now_s);
      all.push_back({r, run.time_s[later], x, y, vx, vy, std::arg(heading), std::arg(axis) / 2, run.x_mm[later],
                     run.y_mm[later]});
    }
  }
  return all;
}

RideModel::RideModel(const std::vector<RideInstant>& train) {
  std::vector<double> speeds;
  std::complex<double> same = 0, turned = 0, same_axis = 0, turned_axis = 0;
  for (const RideInstant& i : train) {
    const double way = std::atan2(i.vy_mm_s, i.vx_mm_s);
    speeds.push_back(speed_of(i));
    same += unit(way - i.heading_rad);
    turned += unit(way + i.heading_rad);
    turned_axis += unit(2 * (way + i.axis_rad));
    same_axis += unit(2 * (way - i.axis_rad));
  }
  const double n = std::max<double>(static_cast<double>(train.size()), 1);
  speed_mm_s = median(speeds);
  aligned = std::abs(same) / n;
  aligned_turned = std::abs(turned) / n;
  aligned_axis = std::abs(turned_axis) / n;
  sense_rad = std::arg(turned);
  // Drift: medians over instants of what is left of the way, in speeds.
  RideEffects on{};
  on[static_cast<std::size_t>(RideEffect::kSense)] = on[static_cast<std::size_t>(RideEffect::kAxis)] = true;
  std::map<std::size_t, std::vector<double>> speeds_of;
  for (const RideInstant& i : train) speeds_of[i.run].push_back(speed_of(i));
  std::map<std::size_t, double> speed_of_run;
  for (const auto& [run, own] : speeds_of) speed_of_run[run] = median(own);
  std::vector<double> left_x, left_y;
  for (const RideInstant& i : train) {
    // The run's speed and not that of the instant, which goes with where it is carried.
    const double speed = speed_of_run[i.run];
    if (!(speed > 0)) continue;
    const std::complex<double> forward = OwnPast{}.direction(i, *this, on);
    left_x.push_back(i.vx_mm_s / speed - forward.real());
    left_y.push_back(i.vy_mm_s / speed - forward.imag());
  }
  drift_x = median(left_x);
  drift_y = median(left_y);
}

std::vector<RideModel::Place> RideModel::predict(const std::vector<RideInstant>& instants, double horizon_s,
                                                 const RideEffects& on) const {
  const auto has = [&](RideEffect effect) { return on[static_cast<std::size_t>(effect)]; };
  std::vector<Place> places;
  OwnPast past;
  std::size_t run = SIZE_MAX;
  for (const RideInstant& now : instants) {
    if (now.run != run) past = {};
    run = now.run;
    past.add(now, *this, on);
    const double speed = has(RideEffect::kSpeed) ? median(past.speeds) : speed_mm_s;
    std::complex<double> way = speed * horizon_s * past.direction(now, *this, on);
    if (has(RideEffect::kTurn)) {
      // Along an arc.
      const double turn = past.own_turn() * horizon_s;
      if (std::abs(turn) > 1e-6) way *= (unit(turn) - 1.0) / (kI * turn);
    }
    if (has(RideEffect::kDrift)) way += speed * horizon_s * past.own_drift(*this);
    places.push_back({now.x_mm + way.real(), now.y_mm + way.imag()});
  }
  return places;
}

std::vector<RideSummary> summaries_of(const RideModel& model, const std::vector<RiddenRun>& runs,
                                      const std::vector<RideInstant>& instants) {
  RideEffects all;
  all.fill(true);
  std::vector<OwnPast> pasts(runs.size());
  std::vector<std::vector<double>> speeds(runs.size());
  for (const RideInstant& now : instants) {
    pasts[now.run].add(now, model, all);
    speeds[now.run].push_back(speed_of(now));
  }
  std::vector<RideSummary> summaries;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (speeds[r].empty()) continue;
    const double speed = median(speeds[r]);
    const std::complex<double> drift = pasts[r].own_drift(model) * speed;
    summaries.push_back(
        {runs[r].name, speed, drift.real(), drift.imag(), pasts[r].own_turn(), pasts[r].own_mount()});
  }
  return summaries;
}

}  // namespace kilotwin::bristle

#include "clients/identify/bristle/bristle_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "clients/identify/bristle/velocity_circle.hpp"
#include "clients/identify/model/motion_model.hpp"
#include "core/effects/motion_change.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::bristle {
namespace {

/// Length of the line through the latest positions, time between instants and before the first one, and rounding of the
/// horizon. A longer line is less noisy and shows older motion; more instants overlap.
constexpr double kLine_s = 0.5, kEvery_s = 1, kFirst_s = 3, kNear_s = 0.1;
/// Rows of a line, less one; with fewer, its slope is too uncertain for an instant.
constexpr std::size_t kFewest = 4;
/// Weight of the population's values in a run's own estimates, in instants.
constexpr double kPrior = 6;
/// A run determines the drift only with this many velocities whose directions nearly average out.
constexpr std::size_t kFewestOnCircle = 12;
constexpr double kOneWay = 0.7;
constexpr std::size_t kFewestRuns = 4;
constexpr std::complex<double> kI(0, 1);
/// Default of Motion.wheel_base_mm in idl/model.proto. Without commands that turn, motion does not depend on it.
constexpr double kWheelBase_mm = 25;

std::complex<double> unit(double angle_rad) { return std::exp(kI * angle_rad); }

/// Least-squares line through rows first..last: value at `at_s`, and slope.
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

double speed_of(const BristleInstant& i) { return std::hypot(i.vx_mm_s, i.vy_mm_s); }

struct RobotWay {
  std::size_t run;
  std::complex<double> way, forward;  ///< unit vectors; forward: along the heading axis, without sign
  double speed;
};

/// The drift, relative to speed, that minimises the velocity across the heading. Jackknife pseudo-values: one
/// estimate per omitted run.
void drift_across_headings(const std::vector<RobotWay>& all, std::vector<double>& xs, std::vector<double>& ys) {
  const auto fit = [&](std::size_t without) {
    // The third parameter is the offset of the heading axis; its sign follows the driving direction.
    Eigen::Vector3d left = Eigen::Vector3d::Zero();
    constexpr double kLimit = 0.3;  // relative to the speed; larger values mean a wrong heading
    for (int iteration = 0; iteration < 10; ++iteration) {
      Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      for (const RobotWay& w : all) {
        if (w.run == without || !(w.speed > 0)) continue;
        const std::complex<double> own = w.way * std::conj(w.forward) / w.speed;
        const Eigen::Vector3d across(-w.forward.imag(), w.forward.real(), own.real() < 0 ? -1 : 1);
        const double weight = std::min(1.0, kLimit / std::max(std::abs(own.imag() - across.dot(left)), 1e-9));
        normal += weight * across * across.transpose();
        right += weight * own.imag() * across;
      }
      left = normal.ldlt().solve(right);
    }
    return Eigen::Vector2d(left.head<2>());
  };
  std::set<std::size_t> runs;
  for (const RobotWay& w : all) runs.insert(w.run);
  const Eigen::Vector2d whole = fit(SIZE_MAX);
  xs.clear();
  ys.clear();
  const auto n = static_cast<double>(runs.size());
  for (const std::size_t run : runs) {
    const Eigen::Vector2d pseudo = runs.size() > 1 ? Eigen::Vector2d(n * whole - (n - 1) * fit(run)) : whole;
    xs.push_back(pseudo.x());
    ys.push_back(pseudo.y());
  }
}

/// p value of a zero mean of pairs (Hotelling's T^2: F with 2 and n - 2 degrees of freedom).
double chance_of_mean(const std::vector<double>& xs, const std::vector<double>& ys) {
  const auto n = static_cast<Eigen::Index>(xs.size());
  if (n < 5) return 1;
  Eigen::MatrixX2d v(n, 2);
  v.col(0) = Eigen::Map<const Eigen::VectorXd>(xs.data(), n);
  v.col(1) = Eigen::Map<const Eigen::VectorXd>(ys.data(), n);
  const Eigen::RowVector2d mean = v.colwise().mean();
  const Eigen::MatrixX2d off = v.rowwise() - mean;
  const auto count = static_cast<double>(n);
  const Eigen::Matrix2d covariance = off.transpose() * off / (count - 1);
  const double square = count * mean * covariance.ldlt().solve(mean.transpose());
  const double f = square * (count - 2) / (2 * (count - 1));
  return std::pow(1 + 2 * f / (count - 2), -(count - 2) / 2);
}

/// Speeds of a robot with both wheels at `speed_mm_s`, under a turn rate and a drift.
identify::Rates driven(double speed_mm_s, double turn_rad_s, std::complex<double> drift_mm_s) {
  using Target = EffectSettings::Target;
  MotionChange change;
  unit_offsets(Target::kTurnRate, true, true, 1, 0, kWheelBase_mm).add_to(change, turn_rad_s);
  unit_offsets(Target::kWorldDrift, true, true, 1, 0, kWheelBase_mm).add_to(change, drift_mm_s.real());
  unit_offsets(Target::kWorldDrift, true, true, 0, 1, kWheelBase_mm).add_to(change, drift_mm_s.imag());
  return {changed_speeds(speed_mm_s, speed_mm_s, change, effects_limit_mm_s(speed_mm_s))};
}

/// Estimates of one run from its past, shrunk towards the population.
struct RunEstimates {
  std::vector<double> speeds;
  std::vector<std::complex<double>> ways;
  VelocityCircle circle;
  std::complex<double> mount = 0;
  double turn = 0, turns = 0;
  std::complex<double> last_way = 0;
  double last_time_s = -std::numeric_limits<double>::infinity();

  void add(const BristleInstant& now, const BristleModel& all, const BristleEffects& effects) {
    const std::complex<double> way(now.vx_mm_s, now.vy_mm_s);
    speeds.push_back(std::abs(way));
    if (speeds.size() > 20) speeds.erase(speeds.begin());
    ways.push_back(way);
    circle = fit_circle(ways, {all.drift_x, all.drift_y}, kPrior);
    const bool drifting = effects[static_cast<std::size_t>(BristleEffect::kDrift)];
    // Doubled angle: an axis has no sign.
    mount += unit(2 * (std::arg(own_velocity(way, drifting)) + now.axis_rad - all.sense_rad));
    if (now.time_s - last_time_s < 1.5 * kEvery_s) {
      const double turned = std::arg(way * std::conj(last_way));
      if (std::abs(turned) < 1.2) {
        turn += turned / (now.time_s - last_time_s);
        ++turns;
      }
    }
    last_way = way;
    last_time_s = now.time_s;
  }
  /// A velocity without the drift.
  [[nodiscard]] std::complex<double> own_velocity(std::complex<double> way, bool drifting) const {
    return drifting ? way - circle.drift * circle.speed_mm_s : way;
  }
  [[nodiscard]] double own_speed(bool drifting) const {
    return drifting ? circle.speed_mm_s : stats::upper_median(speeds);
  }
  [[nodiscard]] double own_mount() const { return std::arg(mount + kPrior) / 2; }
  [[nodiscard]] double own_turn() const { return turn / (turns + kPrior); }
  /// Direction of motion without drift.
  [[nodiscard]] std::complex<double> direction(const BristleInstant& now, const BristleModel& all,
                                               const BristleEffects& on) const {
    const auto has = [&](BristleEffect effect) { return on[static_cast<std::size_t>(effect)]; };
    const double measured = has(BristleEffect::kAxis) ? now.axis_rad : now.heading_rad;
    double heading = has(BristleEffect::kSense) ? all.sense_rad - measured : measured;
    if (has(BristleEffect::kMount)) heading += own_mount();
    std::complex<double> forward = unit(heading);
    const std::complex<double> way = own_velocity({now.vx_mm_s, now.vy_mm_s}, has(BristleEffect::kDrift));
    if (has(BristleEffect::kAxis) && (way * std::conj(forward)).real() < 0) forward = -forward;
    return forward;
  }
};

}  // namespace

std::vector<BristleInstant> instants_of(const std::vector<BristleRun>& runs, double horizon_s) {
  std::vector<BristleInstant> all;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const BristleRun& run = runs[r];
    if (run.size() < 2) continue;
    const double first_s = run.time_s.front() + kFirst_s;
    const auto count = static_cast<int>(std::ceil((run.time_s.back() - horizon_s - first_s) / kEvery_s));
    for (int instant = 0; instant < count; ++instant) {
      const double now_s = first_s + instant * kEvery_s;
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

BristleModel::BristleModel(const std::vector<BristleInstant>& train) {
  std::vector<double> speeds;
  std::complex<double> same = 0, turned = 0, same_axis = 0, turned_axis = 0;
  for (const BristleInstant& i : train) {
    const double way = std::atan2(i.vy_mm_s, i.vx_mm_s);
    speeds.push_back(speed_of(i));
    same += unit(way - i.heading_rad);
    turned += unit(way + i.heading_rad);
    turned_axis += unit(2 * (way + i.axis_rad));
    same_axis += unit(2 * (way - i.axis_rad));
  }
  const double n = std::max<double>(static_cast<double>(train.size()), 1);
  speed_mm_s = stats::upper_median(speeds);
  aligned = std::abs(same) / n;
  aligned_turned = std::abs(turned) / n;
  aligned_axis = std::abs(turned_axis) / n;
  sense_rad = std::arg(turned);
  // Drift: the median over runs whose directions average out. Each run is one observation.
  std::map<std::size_t, std::vector<std::complex<double>>> ways_of;
  for (const BristleInstant& i : train) ways_of[i.run].emplace_back(i.vx_mm_s, i.vy_mm_s);
  std::vector<double> xs, ys;
  for (const auto& [run, ways] : ways_of) {
    const VelocityCircle circle = fit_circle(ways, 0, 0.5);
    if (ways.size() < kFewestOnCircle || circle.prior_share > kOneWay || std::abs(circle.drift) > 1) continue;
    xs.push_back(circle.drift.real());
    ys.push_back(circle.drift.imag());
  }
  const bool across = xs.size() < kFewestRuns;
  if (across) {
    // Runs with one direction each: their drift shows across the heading.
    std::vector<RobotWay> all;
    for (const BristleInstant& i : train) {
      std::vector<double> own;
      for (const std::complex<double>& way : ways_of[i.run]) own.push_back(std::abs(way));
      all.push_back({i.run, {i.vx_mm_s, i.vy_mm_s}, unit(sense_rad - i.axis_rad), stats::upper_median(own)});
    }
    drift_across_headings(all, xs, ys);
  }
  drift_runs = xs.size();
  if (xs.empty()) return;
  const auto middle = [&](const std::vector<double>& v) {
    return across ? std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size())
                  : stats::upper_median(v);
  };
  drift_x = middle(xs);
  drift_y = middle(ys);
  double spread = 0;
  for (std::size_t r = 0; r < xs.size(); ++r)
    spread += (xs[r] - drift_x) * (xs[r] - drift_x) + (ys[r] - drift_y) * (ys[r] - drift_y);
  const auto runs = static_cast<double>(xs.size());
  drift_sd = xs.size() > 1 ? std::sqrt(spread / 2 / (runs - 1)) : 0;
  drift_p = chance_of_mean(xs, ys);
  // Per axis. The standard error of a median is 1.25 times that of a mean.
  drift_se = xs.size() > 1 ? (across ? 1 : 1.25) * std::sqrt(spread / 2 / (runs - 1) / runs) : 1;
}

std::vector<BristleModel::Place> BristleModel::predict(const std::vector<BristleInstant>& instants,
                                                       double horizon_s, const BristleEffects& on) const {
  const auto has = [&](BristleEffect effect) { return on[static_cast<std::size_t>(effect)]; };
  std::vector<Place> places;
  RunEstimates past;
  std::size_t run = SIZE_MAX;
  for (const BristleInstant& now : instants) {
    if (now.run != run) past = {};
    run = now.run;
    past.add(now, *this, on);
    const double speed = has(BristleEffect::kSpeed) ? past.own_speed(has(BristleEffect::kDrift)) : speed_mm_s;
    const std::complex<double> drift = has(BristleEffect::kDrift) ? speed * past.circle.drift : 0;
    const double turn_rad_s = has(BristleEffect::kTurn) ? past.own_turn() : 0;
    const identify::Arc arc = identify::arc_of(driven(speed, turn_rad_s, drift), kWheelBase_mm,
                                               std::arg(past.direction(now, *this, on)), horizon_s);
    places.push_back({now.x_mm + arc.dx_mm, now.y_mm + arc.dy_mm});
  }
  return places;
}

std::vector<BristleSummary> summaries_of(const BristleModel& model, const std::vector<BristleRun>& runs,
                                         const std::vector<BristleInstant>& instants) {
  BristleEffects all;
  all.fill(true);
  std::vector<RunEstimates> pasts(runs.size());
  std::vector<std::vector<double>> speeds(runs.size());
  for (const BristleInstant& now : instants) {
    pasts[now.run].add(now, model, all);
    speeds[now.run].push_back(speed_of(now));
  }
  std::vector<BristleSummary> summaries;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (speeds[r].empty()) continue;
    const VelocityCircle& circle = pasts[r].circle;
    const std::complex<double> drift = circle.drift * circle.speed_mm_s;
    summaries.push_back(
        {runs[r].name, circle.speed_mm_s, drift.real(), drift.imag(), pasts[r].own_turn(), pasts[r].own_mount()});
  }
  return summaries;
}

}  // namespace kilotwin::bristle

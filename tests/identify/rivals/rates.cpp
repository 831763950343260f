#include "tests/identify/rivals/rates.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/stats/quantiles.hpp"
#include "tests/identify/rivals/columns.hpp"

namespace kilotwin::truth {
namespace {

constexpr double kStep_s = 0.1, kNear_mm = 70, kLongest_s = 1.5;

struct Pose {
  Vec point;
  double heading_rad = 0;
};

/// The part of a robot's state at a time that follows from its commands.
Instant commanded(const std::vector<Order>& orders, double time_s) {
  Instant out;
  out.time_s = time_s;
  double since_s = 0;
  for (std::size_t i = 0; i < orders.size() && orders[i].time_s <= time_s + 1e-9; ++i) {
    const double until_s = i + 1 < orders.size() ? std::min(orders[i + 1].time_s, time_s) : time_s;
    if (orders[i].motion != Motion::kStop) out.driven_s += until_s - orders[i].time_s;
    if (i > 0 && orders[i].motion == out.motion) continue;
    out.before = out.motion;
    out.motion = orders[i].motion;
    since_s = orders[i].time_s;
  }
  out.since_change_s = time_s - since_s;
  return out;
}

/// The end of a step from a time on: commands do not change within.
double step_end(const std::vector<Order>& orders, double from_s, double to_s) {
  double end = std::min(from_s + kStep_s, to_s);
  for (const Order& order : orders)
    if (order.time_s > from_s + 1e-9 && order.time_s < end) end = order.time_s;
  return end;
}

Instant instant_of(const Run& run, int robot, double time_s, const Pose& pose, int near) {
  Instant out = commanded(run.orders[static_cast<std::size_t>(robot)], time_s);
  out.robot = robot;
  out.point = pose.point;
  out.heading_rad = pose.heading_rad;
  out.near = near;
  return out;
}

/// Samples by robot.
std::map<int, std::vector<Sample>> tracks_of(const Run& run) {
  std::map<int, std::vector<Sample>> tracks;
  for (const Sample& s : run.samples) tracks[s.robot].push_back(s);
  return tracks;
}

/// The position at a time between samples; nothing outside.
std::optional<Pose> between(const std::vector<Sample>& track, double time_s) {
  const auto next =
      std::lower_bound(track.begin(), track.end(), time_s, [](const Sample& s, double t) { return s.time_s < t; });
  if (next == track.end() || (next == track.begin() && next->time_s > time_s)) return std::nullopt;
  if (next == track.begin()) return Pose{next->point, next->heading_rad};
  const Sample &b = *next, &a = *(next - 1);
  if (b.time_s - a.time_s > kLongest_s) return std::nullopt;
  const double w = (time_s - a.time_s) / (b.time_s - a.time_s);
  return Pose{{a.point.x + w * (b.point.x - a.point.x), a.point.y + w * (b.point.y - a.point.y)},
              a.heading_rad + w * std::remainder(b.heading_rad - a.heading_rad, 2 * M_PI)};
}

int near_to(const std::map<int, std::vector<Sample>>& tracks, int robot, double time_s, Vec at,
            double within_mm = kNear_mm) {
  int count = 0;
  for (const auto& [other, track] : tracks) {
    if (other == robot) continue;
    if (const auto pose = between(track, time_s))
      count += std::hypot(pose->point.x - at.x, pose->point.y - at.y) < within_mm ? 1 : 0;
  }
  return count;
}

Eigen::Vector3d rates_between(const Sample& a, const Sample& b) {
  const double dt = b.time_s - a.time_s, turn = std::remainder(b.heading_rad - a.heading_rad, 2 * M_PI),
               heading = a.heading_rad + turn / 2, c = std::cos(heading), s = std::sin(heading),
               x = b.point.x - a.point.x, y = b.point.y - a.point.y;
  return Eigen::Vector3d{c * x + s * y, c * y - s * x, turn} / dt;
}

/// Lines that tracked points do not cross; infinite without a wall.
struct Area {
  Vec low{-INFINITY, -INFINITY}, high{INFINITY, INFINITY};
};

/// The end of a range of positions if they pile up there, as at a wall; else infinite.
double wall_of(std::vector<double> along, double sign) {
  for (double& c : along) c *= sign;
  const double edge = stats::upper_end(along, along.size() / 1000);
  const auto within = [&](double from, double to) {
    return std::count_if(along.begin(), along.end(), [&](double c) { return c > edge - to && c <= edge - from; });
  };
  constexpr double kPile_mm = 3, kDenser = 3;
  const auto pile = within(-kPile_mm, kPile_mm), before = within(2 * kPile_mm, 4 * kPile_mm);
  return sign * (static_cast<double>(pile) > kDenser * static_cast<double>(before) + 10 ? edge : INFINITY);
}

Area walls_of(const std::vector<Run>& runs) {
  std::vector<double> x, y;
  for (const Run& run : runs) {
    for (const Sample& s : run.samples) {
      x.push_back(s.point.x);
      y.push_back(s.point.y);
    }
  }
  return {{wall_of(x, -1), wall_of(y, -1)}, {wall_of(x, 1), wall_of(y, 1)}};
}

/// Takes a pose from one time to another.
Pose taken(const Rival& rival, const Run& run, int robot, Pose pose, double from_s, double to_s, int near,
           const Area& area) {
  for (double t = from_s; t < to_s - 1e-9;) {
    const double dt = step_end(run.orders[static_cast<std::size_t>(robot)], t, to_s) - t;
    const Eigen::Vector3d r = rival.rates(instant_of(run, robot, t + dt / 2, pose, near));
    const double heading = pose.heading_rad + r[2] * dt / 2, c = std::cos(heading), s = std::sin(heading);
    pose.point.x = std::clamp(pose.point.x + dt * (c * r[0] - s * r[1]), area.low.x, area.high.x);
    pose.point.y = std::clamp(pose.point.y + dt * (s * r[0] + c * r[1]), area.low.y, area.high.y);
    pose.heading_rad += r[2] * dt;
    t += dt;
  }
  return pose;
}

/// The pose at a time from the samples before it; nothing without any.
std::optional<Pose> start_pose(const Rival& rival, const Run& run, const std::vector<Sample>& track, double time_s,
                               const Area& area) {
  constexpr int kSamples = 8;
  constexpr double kFades = 0.75;
  double weight = 1, sum = 0, x = 0, y = 0, c = 0, s = 0;
  auto next = std::upper_bound(track.begin(), track.end(), time_s + 1e-9,
                               [](double t, const Sample& sample) { return t < sample.time_s; });
  for (int k = 0; k < kSamples && next != track.begin(); ++k, weight *= kFades) {
    --next;
    const Pose at = taken(rival, run, next->robot, {next->point, next->heading_rad}, next->time_s, time_s, 0, area);
    sum += weight;
    x += weight * at.point.x;
    y += weight * at.point.y;
    c += weight * std::cos(at.heading_rad);
    s += weight * std::sin(at.heading_rad);
  }
  if (sum == 0) return std::nullopt;
  return Pose{{x / sum, y / sum}, std::atan2(s, c)};
}

}  // namespace

std::vector<RateRow> rate_rows(const std::vector<Run>& runs) {
  constexpr double kAtWall_mm = 6, kTouching_mm = 40;
  const Area area = walls_of(runs);
  const auto at_wall = [&](Vec p) {
    return p.x < area.low.x + kAtWall_mm || p.x > area.high.x - kAtWall_mm || p.y < area.low.y + kAtWall_mm ||
           p.y > area.high.y - kAtWall_mm;
  };
  std::vector<RateRow> rows;
  int number = 0;
  for (const Run& run : runs) {
    const auto tracks = tracks_of(run);
    for (const auto& [robot, track] : tracks) {
      for (std::size_t i = 1; i < track.size(); ++i) {
        const Sample &a = track[i - 1], &b = track[i];
        const double dt = b.time_s - a.time_s;
        if (dt <= 0 || dt > kLongest_s || at_wall(a.point) || at_wall(b.point) ||
            near_to(tracks, robot, a.time_s, a.point, kTouching_mm) > 0)
          continue;
        RateRow row{number, {}, rates_between(a, b)};
        const int near = near_to(tracks, robot, a.time_s, a.point);
        for (double t = a.time_s; t < b.time_s - 1e-9;) {
          const double end = step_end(run.orders[static_cast<std::size_t>(robot)], t, b.time_s),
                       at_s = (t + end) / 2;
          row.instants.push_back(instant_of(run, robot, at_s, *between(track, at_s), near));
          row.instants.back().span_s = end - t;
          t = end;
        }
        rows.push_back(std::move(row));
      }
      ++number;
    }
  }
  return rows;
}

std::vector<Prediction> corrections(const Rival& rival, const Rival& base, const std::vector<Run>& train,
                                    const Run& run, double horizon_s) {
  const Area area = walls_of(train);
  const auto tracks = tracks_of(run);
  std::vector<Prediction> out;
  for (double time_s = std::max(10.0, horizon_s); time_s <= run.duration_s + 1e-9; time_s += kMarkInterval_s) {
    const double from_s = time_s - horizon_s;
    const auto mark = static_cast<std::size_t>(std::lround(time_s / kMarkInterval_s));
    for (const auto& [robot, track] : tracks) {
      const auto start = start_pose(base, run, track, from_s, area);
      if (!start) continue;
      const int near = near_to(tracks, robot, from_s, start->point);
      const Vec with = taken(rival, run, robot, *start, from_s, time_s, near, area).point,
                without = taken(base, run, robot, *start, from_s, time_s, near, area).point;
      out.push_back({run.number,
                     robot,
                     time_s,
                     {with.x - without.x, with.y - without.y},
                     run.marks[static_cast<std::size_t>(robot)][mark].point});
    }
  }
  return out;
}

Rival base_alone(const std::vector<RateRow>& rows, int robots) {
  const Eigen::MatrixXd by_base = base_coefficients(rows, robots);
  Rival rival;
  rival.straight_mm_s = straight_of(by_base, robots);
  rival.rates = [by_base, robots](const Instant& at) -> Eigen::Vector3d {
    Eigen::VectorXd one(base_columns(robots));
    base_of(at, robots, one);
    return by_base.transpose() * one;
  };
  return rival;
}

}  // namespace kilotwin::truth

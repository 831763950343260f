#include "clients/identify/data/command_response.hpp"

#include <algorithm>
#include <cmath>

#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

// Shortest segment. Shorter ones are dominated by tracker noise.
constexpr double kSegment_s = 0.9;
// Longest segment. Longer ones mix several motions.
constexpr double kLongest_s = 3;
constexpr std::size_t kFewest = 30;
// Bound on the standardised residual: limits the influence of one segment.
constexpr double kMostSds = 3.5;

/// Median, and the standard deviation estimated by the median absolute deviation.
template <class Spread> Spread spread_of(std::vector<double> values, double least_sd) {
  const double centre = stats::upper_median(values);
  for (double& v : values) v = std::abs(v - centre);
  return {centre, std::max(1.4826 * stats::upper_median(values), least_sd)};
}

}  // namespace

Motion command_at(const Track& track, double time_s) {
  const auto after = std::upper_bound(track.commands.begin(), track.commands.end(), time_s,
                                      [](double t, const CommandChange& c) { return t < c.time_s; });
  return after == track.commands.begin() ? Motion::kStop : std::prev(after)->motion;
}

std::vector<MotionSegment> segments_of(const Track& track) {
  std::vector<MotionSegment> segments;
  struct Leg {
    double from_s, to_s, x, y;  // x, y: velocity, mm/s
  };
  std::vector<Leg> legs;
  const Sample* from = nullptr;
  for (const Sample& to : track.samples) {
    if (from != nullptr && to.time_s - from->time_s < kSegment_s) continue;
    if (from != nullptr && to.time_s - from->time_s <= kLongest_s) {
      const double dt = to.time_s - from->time_s;
      legs.push_back({from->time_s, to.time_s, (to.x_mm - from->x_mm) / dt, (to.y_mm - from->y_mm) / dt});
    }
    from = &to;
  }
  for (std::size_t k = 1; k + 1 < legs.size(); ++k) {
    const Leg &before = legs[k - 1], &leg = legs[k], &after = legs[k + 1];
    if (before.to_s != leg.from_s || leg.to_s != after.from_s) continue;
    const double curve = 0.5 * (before.x * leg.y - before.y * leg.x + leg.x * after.y - leg.y * after.x);
    segments.push_back({0.5 * (leg.from_s + leg.to_s), std::hypot(leg.x, leg.y), curve});
  }
  return segments;
}

CommandResponse::CommandResponse(const MeasuredSet& set) {
  if (!set.has_commands) return;
  std::array<std::vector<double>, 4> speeds, curves;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (const MotionSegment& segment : segments_of(track)) {
        const auto m = static_cast<std::size_t>(command_at(track, segment.time_s));
        speeds[m].push_back(segment.speed_mm_s);
        curves[m].push_back(segment.curve_mm2_s2);
      }
    }
  }
  int known = 0;
  for (std::size_t m = 0; m < 4; ++m) {
    known_[m] = speeds[m].size() >= kFewest;
    if (!known_[m]) continue;
    ++known;
    speed_[m] = spread_of<Spread>(speeds[m], 0.5);
    curve_[m] = spread_of<Spread>(curves[m], 5);
  }
  distinguishes_commands_ = known >= 2;
}

double CommandResponse::log_likelihood(const MotionSegment& segment, Motion motion) const {
  const auto m = static_cast<std::size_t>(motion);
  if (!known_[m]) return 0;
  const auto of = [](double value, const Spread& spread) {
    const double z = std::min(std::abs(value - spread.middle) / spread.sd, kMostSds);
    return -0.5 * z * z;
  };
  return of(segment.speed_mm_s, speed_[m]) - std::log(speed_[m].sd) + of(segment.curve_mm2_s2, curve_[m]) -
         std::log(curve_[m].sd);
}

}  // namespace kilotwin::identify

#include "clients/identify/model/visited_boundary.hpp"

#include <algorithm>
#include <cmath>

#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// Width of strips along a side; narrower ones follow the boundary closer, from fewer samples each.
constexpr double kStrip_mm = 30;

/// The upper quantile: the value that `share` of the values exceed, and at least `fewest` of them. Trackers
/// produce outliers.
double near_the_end(std::vector<double>& values, std::size_t fewest, double share) {
  const std::size_t beyond = std::max(fewest, static_cast<std::size_t>(share * static_cast<double>(values.size())));
  return stats::upper_end(values, beyond);
}

}  // namespace

VisitedBoundary::VisitedBoundary(const MeasuredSet& set, double margin_mm)
    : sides_{Side{true, 1, 0, {}}, Side{true, -1, 0, {}}, Side{false, 1, 0, {}}, Side{false, -1, 0, {}}},
      margin_mm_(margin_mm) {
  for (Side& side : sides_) {
    std::vector<double> along, downwards;
    for (const Run& run : set.runs)
      for (const Track& track : run.tracks)
        for (const Sample& s : track.samples) along.push_back(side.of_x ? s.y_mm : s.x_mm);
    if (along.empty()) continue;
    for (const double a : along) downwards.push_back(-a);
    // Share of the samples beyond the boundary; a larger value moves it inwards.
    constexpr double kOutliers = 5e-4;
    const double high = near_the_end(along, 3, kOutliers), low = -near_the_end(downwards, 3, kOutliers);
    const auto strips = static_cast<std::size_t>(std::max(1.0, std::round((high - low) / kStrip_mm)));
    side.first_mm = low + kStrip_mm / 2;
    std::vector<std::vector<double>> out(strips);
    for (const Run& run : set.runs)
      for (const Track& track : run.tracks)
        for (const Sample& s : track.samples) {
          const double at = ((side.of_x ? s.y_mm : s.x_mm) - low) / kStrip_mm;
          if (at >= 0 && at < static_cast<double>(strips))
            out[static_cast<std::size_t>(at)].push_back(side.sign * (side.of_x ? s.x_mm : s.y_mm));
        }
    std::vector<double> farthest;
    farthest.reserve(out.size());
    for (std::vector<double>& strip : out)
      farthest.push_back(strip.empty() ? 0 : near_the_end(strip, 2, kOutliers));
    // Where the boundary is inclined, the quantile is that at the outer end of a strip: corrects by half of the
    // fall within the strip.
    for (std::size_t i = 0; i < strips; ++i) {
      const std::size_t before = i > 0 ? i - 1 : i, after = std::min(i + 1, strips - 1);
      const double by_strip =
          after > before ? (farthest[after] - farthest[before]) / static_cast<double>(after - before) : 0;
      side.farthest_mm.push_back(farthest[i] - std::abs(by_strip) / 2);
    }
  }
}

double VisitedBoundary::Side::at(double along_mm) const {
  const double place = (along_mm - first_mm) / kStrip_mm;
  const double last = static_cast<double>(farthest_mm.size()) - 1;
  const double below = std::clamp(std::floor(place), 0.0, last), above = std::min(below + 1, last);
  const double part = std::clamp(place - below, 0.0, 1.0);
  return (1 - part) * farthest_mm[static_cast<std::size_t>(below)] +
         part * farthest_mm[static_cast<std::size_t>(above)];
}

bool VisitedBoundary::is_near(double x_mm, double y_mm) const {
  return std::any_of(sides_.begin(), sides_.end(), [&](const Side& side) {
    if (side.farthest_mm.empty()) return false;
    const double out = side.sign * (side.of_x ? x_mm : y_mm);
    return out > side.at(side.of_x ? y_mm : x_mm) - margin_mm_;
  });
}

}  // namespace kilotwin::identify

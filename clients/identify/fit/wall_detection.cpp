#include "clients/identify/fit/wall_detection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace kilotwin::identify {
namespace {

/// One coordinate of a disc centre while its robot drives straight.
struct Place {
  double at_mm;
  std::size_t track;
};

/// Bounds for a wall: the number of positions and the number of tracks at a line.
struct Evidence {
  std::size_t places, tracks;
};

/// The upper wall along one coordinate: the line at which robots accumulate. Infinite if there is none.
double upper_wall(std::vector<Place> places, double noise_mm, Evidence fewest) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (places.size() < 500) return kNone;
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.at_mm > b.at_mm; });
  // Outliers may lie beyond the wall.
  const double edge = places[std::max<std::size_t>(3, places.size() / 2000)].at_mm;
  const double width = 2 + 3 * noise_mm;
  std::size_t at_edge = 0, before = 0;
  double sum = 0;
  std::set<std::size_t> tracks;
  for (const Place& p : places) {
    if (p.at_mm > edge + width) continue;
    if (p.at_mm > edge - width) {
      ++at_edge;
      sum += p.at_mm;
      tracks.insert(p.track);
    } else if (p.at_mm > edge - 5 * width) {
      ++before;
    } else {
      break;
    }
  }
  // A wall concentrates positions in one strip. The positions of free robots vary slowly between strips.
  const bool crowded = static_cast<double>(at_edge) > 2 * (static_cast<double>(before) / 2 + 3);
  if (at_edge < fewest.places || tracks.size() < fewest.tracks || !crowded) return kNone;
  return sum / static_cast<double>(at_edge);
}

/// A side that no robot reached. The arena's centre is the origin if the sides of the other pair are symmetric about it; then the
/// side is as far from it as the opposite one. Infinite without that, or if robots were beyond.
double mirrored(double opposite_mm, double low_mm, double high_mm, double reached_mm) {
  // Largest offset of a centred arena, as a share of its side, and way beyond the mirrored side that tracker noise may
  // take. Larger values imply sides that are not there.
  constexpr double kNone = std::numeric_limits<double>::infinity(), kSymmetric = 0.005, kBeyond_mm = 4;
  const bool centred = std::abs(low_mm + high_mm) < kSymmetric * (high_mm - low_mm);
  if (!std::isfinite(low_mm) || !std::isfinite(high_mm) || !std::isfinite(opposite_mm) || !centred) return kNone;
  const double side_mm = std::abs(opposite_mm);
  return reached_mm > side_mm + kBeyond_mm ? kNone : side_mm;
}

/// The largest coordinate without outliers; 0 without places.
double farthest(std::vector<Place> places) {
  if (places.empty()) return 0;
  const std::size_t beyond = std::min(std::max<std::size_t>(3, places.size() / 2000), places.size() - 1);
  const auto edge = places.begin() + static_cast<std::ptrdiff_t>(beyond);
  std::nth_element(places.begin(), edge, places.end(),
                   [](const Place& a, const Place& b) { return a.at_mm > b.at_mm; });
  return edge->at_mm;
}

}  // namespace

void add_implied_side(Walls& walls, const Walls& reached) {
  const Walls w = walls;
  if (!std::isfinite(w.x_low_mm))
    walls.x_low_mm = -mirrored(w.x_high_mm, w.y_low_mm, w.y_high_mm, -reached.x_low_mm);
  if (!std::isfinite(w.x_high_mm))
    walls.x_high_mm = mirrored(w.x_low_mm, w.y_low_mm, w.y_high_mm, reached.x_high_mm);
  if (!std::isfinite(w.y_low_mm))
    walls.y_low_mm = -mirrored(w.y_high_mm, w.x_low_mm, w.x_high_mm, -reached.y_low_mm);
  if (!std::isfinite(w.y_high_mm))
    walls.y_high_mm = mirrored(w.y_low_mm, w.x_low_mm, w.x_high_mm, reached.y_high_mm);
}

Walls detected_walls(const PreparedSet& set, const MotionModel& model) {
  std::vector<Place> x, y;
  const bool measures = model.measures();
  const double ahead = model.base.centre_mm - model.base.ahead_mm;
  for (std::size_t v = 0; v < set.views().size(); ++v) {
    const TrackView& view = set.views()[v];
    for (const Sample& s : view.track->samples) {
      if (view.clock->at(s.time_s).command != Motion::kStraight) continue;
      if (measures) {
        const Eigen::Vector3d pose = model.pose_of(s, view.at(s.time_s));
        const double centre = std::isnan(s.heading_rad) ? model.base.ahead_mm : model.base.centre_mm;
        x.push_back({pose[0] + centre * std::cos(pose[2]), v});
        y.push_back({pose[1] + centre * std::sin(pose[2]), v});
        continue;
      }
      const double heading = std::isnan(s.heading_rad) ? 0 : s.heading_rad;
      const double by = std::isnan(s.heading_rad) ? 0 : ahead;
      x.push_back({s.x_mm + by * std::cos(heading), v});
      y.push_back({s.y_mm + by * std::sin(heading), v});
    }
  }
  const double noise = std::sqrt(model.noise.position_mm2);
  const auto turned = [](std::vector<Place> places) {
    for (Place& p : places) p.at_mm = -p.at_mm;
    return places;
  };
  const std::vector<Place> x_turned = turned(x), y_turned = turned(y);
  const auto seen = [&](Evidence fewest) {
    return Walls{-upper_wall(x_turned, noise, fewest), upper_wall(x, noise, fewest),
                 -upper_wall(y_turned, noise, fewest), upper_wall(y, noise, fewest)};
  };
  const Walls walls = seen({25, 2});
  // If three sides have walls, the fourth needs less evidence.
  constexpr int kMostSides = 3;
  if (walls.sides() < kMostSides) return walls;
  Walls all = seen({8, 1});
  add_implied_side(all, {-farthest(x_turned), farthest(x), -farthest(y_turned), farthest(y)});
  return all;
}

}  // namespace kilotwin::identify

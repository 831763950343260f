#include "clients/identify/search/map_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace kilotwin::identify {
namespace {

/// Places at which the map is compared with parts. More cost time in proportion, for each part that is tried; fewer miss
/// small discs.
constexpr std::size_t kMostPoints = 4000;
/// Positions along an axis, and radii as shares of the larger side of the visited area; directions of half a turn.
constexpr int kCentresAcross = 14, kDirections = 36;
constexpr std::array<double, 6> kDiscRadii = {0.08, 0.14, 0.2, 0.3, 0.42, 0.6};
/// Least share of the points on either side of an edge.
constexpr double kLeastSide = 0.005;
/// Gains below count as this.
constexpr double kLeastGain = -0.95;

double side_mm(const Extent& e) { return std::max(e.x_high_mm - e.x_low_mm, e.y_high_mm - e.y_low_mm); }

double coordinate_mm(const Axis& axis, const MapPoint& point) {
  Situation s;
  s.x_mm = point.x_mm;
  s.y_mm = point.y_mm;
  return value_of(axis, s, 0);
}

/// The edge that explains most, and how much that is.
std::pair<double, double> best_edge(const std::vector<MapPoint>& points, const Axis& axis) {
  std::vector<std::pair<double, double>> sorted;
  sorted.reserve(points.size());
  for (const MapPoint& point : points) sorted.emplace_back(coordinate_mm(axis, point), point.value);
  std::sort(sorted.begin(), sorted.end());
  const double all = static_cast<double>(sorted.size());
  double sum = 0, most = 0, edge_mm = sorted.empty() ? 0 : sorted.front().first;
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
    sum += sorted[i].second;
    const double n = static_cast<double>(i + 1);
    if (n < kLeastSide * all || n > (1 - kLeastSide) * all) continue;
    const double explained = sum * sum * (1 / n + 1 / (all - n));
    if (!(explained > most)) continue;
    most = explained;
    edge_mm = (sorted[i].first + sorted[i + 1].first) / 2;
  }
  return {edge_mm, most};
}

}  // namespace

std::vector<MapPoint> positions_of(const PreparedSet& tracks) {
  std::size_t samples = 0;
  for (const TrackView& view : tracks.views()) samples += view.track->samples.size();
  const std::size_t every = samples / kMostPoints + 1;
  std::vector<MapPoint> points;
  std::size_t next = 0;
  for (const TrackView& view : tracks.views())
    for (const Sample& sample : view.track->samples)
      if (next++ % every == 0) points.push_back({sample.time_s, sample.x_mm, sample.y_mm, 0});
  return points;
}

void add_effect(std::vector<MapPoint>& points, const Term& term, Target target, double factor,
                std::size_t first_block, std::size_t end_block) {
  const auto weight_of = [target](Target of) {
    if (of == target) return 1.0;
    return target == Target::kGain && (of == Target::kGainLeft || of == Target::kGainRight) ? 0.5 : 0.0;
  };
  std::array<double, kMostColumns> values;
  Situation s;
  for (MapPoint& point : points) {
    s.time_s = point.time_s;
    s.x_mm = point.x_mm;
    s.y_mm = point.y_mm;
    Eigen::Index first = 0;
    for (std::size_t b = 0; b < std::min(end_block, term.blocks.size()); ++b) {
      const Block& block = term.blocks[b];
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      const double weight = weight_of(block.target);
      if (weight > 0 && b >= first_block) {
        block.basis.evaluate(s, 0, values.data());
        const double effect =
            term.coefficients.segment(first, n).dot(Eigen::Map<Eigen::VectorXd>(values.data(), n));
        point.value += factor * weight * (is_gain(target) ? std::log1p(std::max(effect, kLeastGain)) : effect);
      }
      first += n;
    }
  }
}

void subtract_mean(std::vector<MapPoint>& points) {
  double sum = 0;
  for (const MapPoint& point : points) sum += point.value;
  for (MapPoint& point : points) point.value -= sum / static_cast<double>(points.size());
}

double sum_of_squares(const std::vector<MapPoint>& points) {
  double sum = 0;
  for (const MapPoint& point : points) sum += point.value * point.value;
  return sum;
}

double explained_by(const std::vector<MapPoint>& points, const MapPart& part) {
  double sum = 0, inside = 0;
  for (const MapPoint& point : points) {
    const double in = coordinate_mm(part.axis, point) < part.edge_mm ? 1 : 0;
    sum += in * point.value;
    inside += in;
  }
  const double all = static_cast<double>(points.size());
  if (inside < kLeastSide * all || inside > (1 - kLeastSide) * all) return 0;
  return sum * sum * (1 / inside + 1 / (all - inside));
}

MapPart best_disc(const std::vector<MapPoint>& points, const Extent& e) {
  const double side = side_mm(e);
  MapPart best{{Covariate::kPointDistance}, 0};
  double most = -1;
  const auto better = [&](const MapPart& part) {
    const double explained = explained_by(points, part);
    // Negated, so that a share that is no number is not better.
    if (!(explained > most)) return false;
    most = explained;
    best = part;
    return true;
  };
  MapPart trial = best;
  for (int j = 0; j < kCentresAcross; ++j) {
    for (int i = 0; i < kCentresAcross; ++i) {
      trial.axis.point.x_mm = e.x_low_mm + (i + 0.5) / kCentresAcross * (e.x_high_mm - e.x_low_mm);
      trial.axis.point.y_mm = e.y_low_mm + (j + 0.5) / kCentresAcross * (e.y_high_mm - e.y_low_mm);
      for (const double radius : kDiscRadii) {
        trial.edge_mm = radius * side;
        better(trial);
      }
    }
  }
  double length = side / kCentresAcross;
  while (length > side / 400) {
    for (bool moved = true; moved;) {
      moved = false;
      for (int number = 0; number < 3; ++number) {
        for (const double by : {length, -length}) {
          trial = best;
          (number == 0 ? trial.axis.point.x_mm : number == 1 ? trial.axis.point.y_mm : trial.edge_mm) += by;
          moved = better(trial) || moved;
        }
      }
    }
    length /= 2;
  }
  return best;
}

MapPart best_half_plane(const std::vector<MapPoint>& points, const Extent& e) {
  MapPart best{{Covariate::kAlong}, 0};
  double most = -1;
  const auto better = [&](double along_rad) {
    Axis axis{Covariate::kAlong};
    axis.along_rad = along_rad;
    const auto [edge_mm, explained] = best_edge(points, axis);
    if (!(explained > most)) return false;
    most = explained;
    best = {axis, edge_mm};
    return true;
  };
  for (int i = 0; i < kDirections; ++i) better(M_PI * i / kDirections);
  // Shift of the edge at the area's side by the last turn of its direction; a smaller one costs time only.
  constexpr double kLast_mm = 1;
  double step_rad = M_PI / kDirections / 2;
  while (step_rad * side_mm(e) > kLast_mm) {
    const double middle_rad = best.axis.along_rad;
    if (!better(middle_rad + step_rad)) better(middle_rad - step_rad);
    step_rad /= 2;
  }
  return best;
}

double best_edge_mm(const std::vector<MapPoint>& points, const Axis& axis) { return best_edge(points, axis).first; }

}  // namespace kilotwin::identify

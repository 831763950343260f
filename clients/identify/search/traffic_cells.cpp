#include "clients/identify/search/traffic_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/search/visits.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// Classes of driven time per cell, with increasing width, or of the freshness of a trail.
class Classes {
 public:
  /// Classes, each with a speed of its own; more follow the effect closer, and chance too.
  static constexpr std::size_t kCount = 16;
  explicit Classes(bool trail)
      : per_value_(trail ? 1.0F * (kOf - 1) : static_cast<float>(1 / RunNeighbours::kRaster_s)) {
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const double time_s = static_cast<double>(i) * RunNeighbours::kRaster_s;
      // 0 is a class of its own: no trail.
      const double of_trail = i == 0 ? 0 : 1 + (kCount - 1.0) * static_cast<double>(i) / kOf;
      of_[i] =
          static_cast<std::uint8_t>(trail ? of_trail : std::min(2.4 * std::log2(1 + 2 * time_s), kCount - 1.0));
    }
  }
  [[nodiscard]] std::size_t of(float value) const {
    return of_[std::min(static_cast<std::size_t>(std::floor(value * per_value_ + 0.5F)), of_.size() - 1)];
  }

 private:
  /// Entries of the table: times of kRaster_s each, of which longer ones count as the last, or freshness from 0 to 1.
  static constexpr std::size_t kOf = 512;
  float per_value_;
  std::array<std::uint8_t, kOf> of_;
};

/// Half the sum of squares that a speed per class explains.
double explained(const Visits& visits, const GridCells& cells) {
  static const Classes of_times(false), of_trails(true);
  const Classes& classes = cells.trail ? of_trails : of_times;
  std::array<double, Classes::kCount> score{}, information{};
  for (const std::vector<Instant>& run : visits.runs) {
    TrafficGrid traffic(cells);
    double now_s = -visits.every_s;
    for (const Instant& instant : run) {
      now_s += visits.every_s;
      for (const Visit& v : instant) {
        if (v.information == 0) continue;
        const std::size_t c = classes.of(traffic.value(v.robot, v.x_mm, v.y_mm, now_s));
        score[c] += v.score;
        information[c] += v.information;
      }
      for (const Visit& v : instant)
        if (v.driven) traffic.add(v.robot, v.x_mm, v.y_mm, visits.every_s, now_s);
    }
  }
  double sum = 0;
  for (std::size_t c = 0; c < score.size(); ++c)
    if (information[c] > 0) sum += 0.5 * score[c] * score[c] / information[c];
  return sum;
}

struct RatedCells {
  GridCells cells;
  double value = -1;
};

/// Coordinate ascent with decreasing steps.
RatedCells climbed(const Visits& visits, RatedCells best, double extent_mm) {
  constexpr double kFinest = 0.004;  // relative to the cell side
  double step = 0.16;
  while (step > kFinest) {
    for (bool better = true; better;) {
      better = false;
      // A step in the cell side displaces the outermost cells by that share of their side.
      const double side = best.cells.side_mm, move = step * side;
      // Times vary by twice the share of lengths.
      const double by_time = 2 * step * best.cells.forget_s;
      for (const auto& [by_side, by_x, by_y, by_forget] : {std::array{move * side / extent_mm, 0.0, 0.0, 0.0},
                                                           {0.0, move, 0.0, 0.0},
                                                           {0.0, 0.0, move, 0.0},
                                                           {0.0, 0.0, 0.0, by_time}}) {
        if (by_forget == 0 && by_side == 0 && by_x == 0 && by_y == 0) continue;
        for (const double sign : {1.0, -1.0}) {
          RatedCells trial;
          trial.cells = {best.cells.side_mm + sign * by_side, best.cells.x_mm + sign * by_x,
                         best.cells.y_mm + sign * by_y, best.cells.forget_s + sign * by_forget, best.cells.trail};
          trial.value = explained(visits, trial.cells);
          if (trial.value <= best.value) continue;
          best = trial;
          better = true;
          break;
        }
      }
    }
    step /= 2;
  }
  // The cell corner nearest to the origin.
  best.cells.x_mm = std::remainder(best.cells.x_mm, best.cells.side_mm);
  best.cells.y_mm = std::remainder(best.cells.y_mm, best.cells.side_mm);
  return best;
}

}  // namespace

GridCells fit_grid_cells(const Fitter& fitter, const FitState& state, const GridCells& from, std::uint8_t during) {
  const Visits visits = visits_of(fitter, state, during);
  std::vector<float> away;
  for (const auto& run : visits.runs)
    for (const Instant& instant : run)
      for (const Visit& v : instant) away.push_back(std::max(std::abs(v.x_mm), std::abs(v.y_mm)));
  if (away.empty()) return from;
  const double extent_mm = std::max<double>(stats::upper_end(away, away.size() / 50), from.side_mm);
  // Grid of the global search: sides so dense that the outermost cells still match, corners a third of a cell
  // apart.
  constexpr double kSmallest_mm = 14, kLargest_mm = 150;
  constexpr int kCorners = 3;
  std::vector<RatedCells> all{{from, 0}};
  double side = kSmallest_mm;
  while (side < kLargest_mm) {
    for (int i = 0; i < kCorners; ++i)
      for (int j = 0; j < kCorners; ++j)
        all.push_back({{side, side * i / kCorners, side * j / kCorners, from.forget_s, from.trail}, 0});
    side *= 1 + 0.3 * side / extent_mm;
  }
  os::in_parallel(all.size(), fitter.threads(),
                  [&](std::size_t i) { all[i].value = explained(visits, all[i].cells); });
  std::stable_sort(all.begin(), all.end(),
                   [](const RatedCells& a, const RatedCells& b) { return a.value > b.value; });
  // Cells that are refined, the best of the raster; more cost a climb each and miss the optimum less often.
  constexpr std::size_t kClimbed = 6;
  all.resize(std::min(all.size(), kClimbed));
  os::in_parallel(all.size(), fitter.threads(),
                  [&](std::size_t i) { all[i] = climbed(visits, all[i], extent_mm); });
  return std::max_element(all.begin(), all.end(),
                          [](const RatedCells& a, const RatedCells& b) { return a.value < b.value; })
      ->cells;
}

}  // namespace kilotwin::identify

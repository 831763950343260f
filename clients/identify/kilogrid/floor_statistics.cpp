#include "clients/identify/kilogrid/floor_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

#include "clients/identify/kilogrid/floor_groups.hpp"
#include "clients/identify/kilogrid/track_windows.hpp"

namespace kilotwin::kilogrid {
namespace {

using namespace groups;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kOpen_mm = 150;   ///< distance from walls: no boundary cell is received there
constexpr double kBeside_mm = 60;  ///< distance of "beside a wall"
constexpr double kAlong_mm = 75;   ///< distance of "along the boundary"
constexpr double kStill_mm = 16;   ///< displacement per block: less than the cell resolution
constexpr double kMoving_mm = 40;  ///< displacement per block: the direction is known
constexpr double kTimeBin_s = 300;
constexpr double kFewestRobots = 4;        ///< effective number of robots of a mean
constexpr std::size_t kExtentFeature = 8;  ///< index of the extent feature, in units of 100 mm
constexpr double kExtentScale_mm = 100;
constexpr double kMiddle_mm = 300;  ///< distance from walls
constexpr double kNear_mm = 100;
constexpr double kGentle_rad = 1.2;  ///< turns by bias while driving straight, not by the walk

/// Accumulates the contribution of one robot.
class Sums {
 public:
  Sums() : sums_{std::vector<double>(statistic_count(), 0), std::vector<double>(statistic_count(), 0)} {}
  void add(Group group, std::size_t i, double value, double weight = 1) {
    const std::size_t at = statistic_groups()[group].first + i;
    sums_.sum[at] += value * weight;
    sums_.weight[at] += weight;
  }
  /// Counts an event in bin `hit` of `bins`.
  void count(Group group, std::size_t hit, std::size_t bins) {
    for (std::size_t i = 0; i < bins; ++i) add(group, i, i == hit ? 1 : 0);
  }
  [[nodiscard]] RobotSums take() { return std::move(sums_); }

 private:
  RobotSums sums_;
};

/// The last bin with a lower edge at most `value`.
template <std::size_t N> std::size_t bin_of(const std::array<double, N>& edges, double value) {
  return static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), value) - edges.begin()) - 1;
}
std::size_t part_of(double value, double whole, std::size_t parts) {
  return std::min(static_cast<std::size_t>(std::max(value / whole, 0.0) * static_cast<double>(parts)), parts - 1);
}

struct Mean {
  double sum = 0, count = 0;
  void add(double v) {
    sum += v;
    ++count;
  }
  [[nodiscard]] double value() const { return sum / count; }
};

/// The product of two halves of a run estimates the variance of the persistent part, without noise.
void add_halves(Sums& sums, Group group, const std::array<Mean, 2>& halves, double about, double enough = 10) {
  if (halves[0].count < enough || halves[1].count < enough) return;
  const double a = halves[0].value() - about, b = halves[1].value() - about;
  sums.add(group, 0, (halves[0].value() + halves[1].value()) / 2);
  sums.add(group, 1, (a * a + b * b) / 2);
  sums.add(group, 2, a * b);
}

class Motions {
 public:
  Motions(const FloorBlocks& blocks, const Floor& floor, std::size_t robot)
      : x_(blocks.x_mm[robot]), y_(blocks.y_mm[robot]), floor_(floor), steps_(x_.size() - 1) {
    for (std::size_t k = 0; k < steps_.size(); ++k) steps_[k] = {x_[k + 1] - x_[k], y_[k + 1] - y_[k]};
  }
  void add_to(Sums& sums, const std::vector<std::size_t>& neighbours) {
    std::array<Mean, 2> turning, speeds;
    std::vector<double> open(steps_.size(), kNan), gentle(steps_.size(), kNan);
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      if (!known(k)) continue;
      sums.count(kShareX, part_of(x_[k], floor_.width_mm, kAcross), kAcross);
      sums.count(kShareY, part_of(y_[k], floor_.height_mm, kAcross), kAcross);
      add_inward(sums, kInwardX, x_, k, floor_.width_mm);
      add_inward(sums, kInwardY, y_, k, floor_.height_mm);
      const double step_mm = std::abs(steps_[k]), wall_mm = wall_distance_mm(floor_, x_[k], y_[k]);
      const std::size_t half = k < steps_.size() / 2 ? 0 : 1;
      sums.add(kWall, bin_of(kWalls_mm, wall_mm), step_mm);
      if (const std::size_t t = part_of(static_cast<double>(k) * FloorBlocks::kBlock_s,
                                        2 * kTimeBin_s * kMiddleBins, kMiddleBins + 1);
          t < kMiddleBins)
        sums.add(kMiddle, t, wall_mm > kMiddle_mm ? 1 : 0);
      sums.count(kRing, part_of(wall_mm, floor_.width_mm / 2, kRings), kRings);
      for (std::size_t i = 0; i < kBoundarySections; ++i)
        sums.add(kBoundary, i, wall_mm < kAlong_mm && boundary_section(floor_, x_[k], y_[k]) == i ? 1 : 0);
      sums.add(kDrift, 0, steps_[k].real());
      sums.add(kDrift, 1, steps_[k].imag());
      if (wall_mm < kOpen_mm) continue;
      sums.count(kStep, bin_of(kSteps_mm, step_mm), kSteps_mm.size());
      const double time_s = static_cast<double>(k) * FloorBlocks::kBlock_s;
      if (const auto t = static_cast<std::size_t>(time_s / kTimeBin_s); t < kTimeBins) sums.add(kTime, t, step_mm);
      sums.add(kCrowd, std::min(neighbours[k], kNeighbours - 1), step_mm);
      if (step_mm > kMoving_mm)
        sums.add(kDirection, part_of(std::arg(steps_[k]) + 3.14159265, 6.2831853, kSectors), step_mm);
      const std::size_t column = part_of(x_[k], floor_.width_mm, kColumns),
                        row = part_of(y_[k], floor_.height_mm, kRows);
      sums.add(kPlace, row * kColumns + column, step_mm);
      speeds[half].add(step_mm);
      open[k] = (step_mm - kAboutSpeed_mm) / kAboutSpeed_mm;
      if (k == 0 || !known(k - 1) || step_mm < kMoving_mm || std::abs(steps_[k - 1]) < kMoving_mm) continue;
      const double turn_rad = std::arg(steps_[k] * std::conj(steps_[k - 1]));
      sums.count(kTurn, part_of(std::abs(turn_rad), 3.14159265, kTurns), kTurns);
      if (std::abs(turn_rad) > kGentle_rad) continue;
      turning[half].add(turn_rad);
      gentle[k] = turn_rad;
    }
    add_lasting(sums, kSpeedLasts, open);
    add_lasting(sums, kTurnLasts, gentle);
    add_halves(sums, kBias, turning, 0);
    add_halves(sums, kSpeed, speeds, kAboutSpeed_mm);
    add_ways(sums);
    add_still(sums, kStillOpen, kOpenRuns, [&](double wall_mm) { return wall_mm > kOpen_mm; });
    add_still(sums, kStillWall, kWallRuns, [&](double wall_mm) { return wall_mm < kBeside_mm; });
    add_stays(sums);
  }

 private:
  [[nodiscard]] bool known(std::size_t k) const { return !std::isnan(steps_[k].real()); }

  /// Motion towards the middle line of the floor, by distance from it.
  void add_inward(Sums& sums, Group group, const std::vector<double>& at, std::size_t k, double whole_mm) {
    if (k + kWay >= at.size() || std::isnan(at[k + kWay])) return;
    const double off = at[k] - whole_mm / 2, way = at[k + kWay] - at[k];
    sums.add(group, part_of(std::abs(off), whole_mm / 2, kToMiddle), off > 0 ? -way : way);
  }

  static void add_lasting(Sums& sums, Group group, const std::vector<double>& of) {
    for (std::size_t i = 0; i < kLasting.size(); ++i) {
      const auto lag = static_cast<std::size_t>(kLasting[i]);
      for (std::size_t k = 0; k + lag < of.size(); ++k) {
        const double product = of[k] * of[k + lag];
        if (!std::isnan(product)) sums.add(group, i, product);
      }
    }
  }

  void add_ways(Sums& sums) {
    for (std::size_t i = 0; i < kLags.size(); ++i) {
      const auto lag = static_cast<std::size_t>(kLags[i]);
      for (std::size_t k = 0; k + lag < x_.size(); ++k) {
        const double dx = x_[k + lag] - x_[k], dy = y_[k + lag] - y_[k];
        if (!std::isnan(dx)) sums.add(kMsd, i, dx * dx + dy * dy);
      }
    }
  }

  /// Episodes of rest per 1000 blocks, by length. Blocks without reports are skipped.
  template <class Lengths, class Where>
  void add_still(Sums& sums, Group group, const Lengths& lengths, Where&& where) {
    int run = 0;
    double blocks = 0;
    std::vector<double> episodes(lengths.size(), 0);
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      if (!known(k)) continue;
      const bool there = where(wall_distance_mm(floor_, x_[k], y_[k]));
      blocks += there ? 1 : 0;
      if (there && std::abs(steps_[k]) < kStill_mm) {
        ++run;
        continue;
      }
      for (std::size_t i = 0; i < lengths.size(); ++i) episodes[i] += run >= lengths[i] ? 1 : 0;
      run = 0;
    }
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      episodes[i] += run >= lengths[i] ? 1 : 0;
      if (blocks > 0) sums.add(group, i, 1000 * episodes[i] / blocks, blocks);
    }
  }

  /// Stays beside a wall, per 1000 blocks. Blocks without reports are skipped.
  void add_stays(Sums& sums) {
    int stay = 0;
    double blocks = 0;
    std::vector<double> stays(kStays.size(), 0);
    const auto end = [&] {
      for (std::size_t i = 0; i < kStays.size(); ++i) stays[i] += stay >= kStays[i] ? 1 : 0;
      stay = 0;
    };
    for (std::size_t k = 0; k < x_.size(); ++k) {
      if (std::isnan(x_[k])) continue;
      ++blocks;
      if (wall_distance_mm(floor_, x_[k], y_[k]) < kBeside_mm) {
        ++stay;
      } else {
        end();
      }
    }
    end();
    for (std::size_t i = 0; i < kStays.size(); ++i) {
      if (blocks > 0) sums.add(kStay, i, 1000 * stays[i] / blocks, blocks);
    }
  }

  const std::vector<double>&x_, &y_;
  const Floor& floor_;
  std::vector<std::complex<double>> steps_;
};

/// For three successive reports of one module, 2 s apart: whether its polling advanced by the same number twice.
void add_pace(Sums& sums, const FloorTrack& track, double cell_mm) {
  const auto cell = [&](std::size_t i) {
    return std::pair{static_cast<int>(track.x_mm[i] / cell_mm), static_cast<int>(track.y_mm[i] / cell_mm)};
  };
  const auto place = [](std::pair<int, int> c) { return c.first % 2 + 2 * (c.second % 2); };
  for (std::size_t i = 2; i < track.size(); ++i) {
    if (track.time_s[i] - track.time_s[i - 1] != 2 || track.time_s[i - 1] - track.time_s[i - 2] != 2) continue;
    const auto a = cell(i - 2), b = cell(i - 1), c = cell(i);
    const auto same = [&](std::pair<int, int> other) {
      return a.first / 2 == other.first / 2 && a.second / 2 == other.second / 2;
    };
    if (!same(b) || !same(c)) continue;
    sums.add(kReports, 6, (place(b) - place(a) + 4) % 4 == (place(c) - place(b) + 4) % 4 ? 1 : 0);
  }
}

void add_reports(Sums& sums, const FloorTrack& track, const std::vector<double>& block_x_mm, double cell_mm) {
  add_pace(sums, track, cell_mm);
  std::vector<bool> empty(block_x_mm.size(), true);
  for (const double time_s : track.time_s)
    empty[std::min(static_cast<std::size_t>(time_s / FloorBlocks::kBlock_s), empty.size() - 1)] = false;
  for (std::size_t k = 0; k < empty.size(); ++k) {
    sums.add(kReports, 7, empty[k] ? 1 : 0);
    if (k > 0 && empty[k - 1]) sums.add(kReports, 8, empty[k] ? 1 : 0);
  }
  Mean unheard;
  for (const double x : block_x_mm) {
    sums.add(kReports, 0, std::isnan(x) ? 1 : 0);
    unheard.add(std::isnan(x) ? 1 : 0);
  }
  sums.add(kReports, 5, unheard.value() * unheard.value());
  std::optional<std::size_t> first;  // first of the reports at the previous time
  for (std::size_t i = 0; i < track.size();) {
    std::size_t end = i;
    while (end < track.size() && track.time_s[end] == track.time_s[i]) ++end;
    sums.add(kReports, 2, end - i > 1 ? 1 : 0);
    if (first) {
      const double gap_s = track.time_s[i] - track.time_s[*first];
      sums.add(kReports, 1, gap_s <= 3 ? 1 : 0);
      if (gap_s == 2) {
        const double way_mm =
            std::abs(track.x_mm[i] - track.x_mm[*first]) + std::abs(track.y_mm[i] - track.y_mm[*first]);
        sums.add(kReports, 3, way_mm < cell_mm / 2 ? 1 : 0);
        sums.add(kReports, 4, way_mm > cell_mm / 2 && way_mm < 1.5 * cell_mm ? 1 : 0);
      }
    }
    first = i;
    i = end;
  }
}

/// Histogram of the classifier's features and of their products.
void add_window(Sums& sums, const std::vector<double>& feature) {
  std::array<double, kFeatures.size()> scaled;
  for (std::size_t f = 0; f < kFeatures.size(); ++f) {
    const FeatureScale& scale = kFeatures[f];
    const auto above =
        std::upper_bound(scale.edges.begin() + 1, scale.edges.end(), feature[f]) - scale.edges.begin();
    sums.count(static_cast<Group>(kWindows + f), static_cast<std::size_t>(above) - 1, scale.edges.size());
    scaled[f] = std::clamp((feature[f] - scale.middle) / scale.width, -4.0, 4.0);
  }
  std::size_t pair = 0;
  for (std::size_t f = 0; f < kFeatures.size(); ++f) {
    for (std::size_t g = 0; g < f; ++g) sums.add(kPairs, pair++, scaled[f] * scaled[g]);
  }
}

/// Number of neighbours within range in each block.
std::vector<std::vector<std::size_t>> count_neighbours(const FloorBlocks& blocks) {
  std::vector<std::vector<std::size_t>> all(blocks.robots(), std::vector<std::size_t>(blocks.blocks, 0));
  for (std::size_t k = 0; k < blocks.blocks; ++k) {
    for (std::size_t a = 0; a < blocks.robots(); ++a) {
      for (std::size_t b = a + 1; b < blocks.robots(); ++b) {
        const double dx = blocks.x_mm[a][k] - blocks.x_mm[b][k], dy = blocks.y_mm[a][k] - blocks.y_mm[b][k];
        if (!(dx * dx + dy * dy < kNear_mm * kNear_mm)) continue;  // also false if a position is unknown
        ++all[a][k];
        ++all[b][k];
      }
    }
  }
  return all;
}

}  // namespace

std::vector<RobotSums> robot_sums(const FloorRun& run, const Floor& floor) {
  const FloorBlocks blocks = blocks_of(run);
  const auto neighbours = count_neighbours(blocks);
  const std::vector<TrackWindow> windows = windows_of(blocks, floor);
  auto window = windows.begin();
  std::vector<RobotSums> all;
  for (std::size_t robot = 0; robot < blocks.robots(); ++robot) {
    Sums sums;
    Motions(blocks, floor, robot).add_to(sums, neighbours[robot]);
    std::array<Mean, 2> extents;
    const auto last = std::find_if(window, windows.end(), [&](const TrackWindow& w) { return w.robot != robot; });
    for (auto w = window; w != last; ++w) {
      add_window(sums, w->feature);
      extents[w - window < (last - window) / 2 ? 0 : 1].add(w->feature[kExtentFeature] / kExtentScale_mm);
    }
    window = last;
    // Windows that each half of a run needs, and the extent that squares are taken about. Fewer windows give halves that
    // differ by chance.
    constexpr double kFewestWindows = 3, kAboutExtent = 4.7;
    add_halves(sums, kExtent, extents, kAboutExtent, kFewestWindows);
    add_reports(sums, run.tracks[robot], blocks.x_mm[robot], floor.cell_mm);
    all.push_back(sums.take());
  }
  return all;
}

FloorStatistics statistics_of(std::span<const RobotSums> robots) {
  FloorStatistics statistics;
  for (std::size_t s = 0; s < statistic_count(); ++s) {
    double sum = 0, weight = 0, squares = 0, spread = 0;
    for (const RobotSums& robot : robots) {
      sum += robot.sum[s];
      weight += robot.weight[s];
      squares += robot.weight[s] * robot.weight[s];
    }
    // The variance of a mean over few robots is unreliable.
    const bool known = squares > 0 && weight * weight >= kFewestRobots * squares;
    const double mean = known ? sum / weight : kNan;
    for (const RobotSums& robot : robots) {
      const double off = robot.sum[s] - mean * robot.weight[s];
      spread += off * off;
    }
    statistics.value.push_back(mean);
    statistics.variance.push_back(known ? spread / (weight * weight) : kNan);
  }
  return statistics;
}

}  // namespace kilotwin::kilogrid

#include "clients/identify/kilogrid/floor_statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

#include "clients/identify/kilogrid/floor_swarm.hpp"
#include "clients/identify/kilogrid/track_windows.hpp"

namespace kilotwin::kilogrid {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kOpen_mm = 150;   ///< from walls: no cell of the rim is heard there
constexpr double kBeside_mm = 60;  ///< a wall
constexpr double kAlong_mm = 75;   ///< the rim
constexpr double kStill_mm = 16;   ///< in a block: less than what cells blur
constexpr double kMoving_mm = 40;  ///< in a block: the direction is known
constexpr double kTimeBin_s = 300;
constexpr double kFewestRobots = 4;  ///< that a mean is taken of, counted by their weights
constexpr std::size_t kTimeBins = 16, kMiddleBins = 8;
constexpr std::size_t kExtentFeature = 8;  ///< of a track window, taken in 100 mm
constexpr double kExtentScale_mm = 100;
constexpr double kMiddle_mm = 300;  ///< from walls
constexpr double kNear_mm = 100;
constexpr double kAboutSpeed_mm = 75;  ///< a usual step
constexpr double kGentle_rad = 1.2;    ///< turns of a straight robot with a bias, not of the walk

constexpr std::array kSteps_mm = {0., 8., 16., 24., 32., 40., 50., 60., 70., 80., 90., 100., 110., 120., 150.};
constexpr std::array kLags = {1, 2, 5, 10, 20, 30, 60};
constexpr std::array kWalls_mm = {0., 40., 50., 60., 75., 100., 150., 200., 300.};
constexpr std::size_t kRings = 10, kTurns = 8, kSectors = 8, kNeighbours = 5;
constexpr std::array kOpenRuns = {1, 2, 3, 4};
constexpr std::array kWallRuns = {1, 2, 3, 4, 6, 9, 12};
constexpr std::array kStays = {1, 2, 3, 5, 10, 20, 40, 80};
constexpr std::size_t kColumns = 4, kRows = 8;
constexpr std::size_t kAcross = 10, kToMiddle = 5;
constexpr std::size_t kWay = 10;  ///< blocks, over which robots go to the middle
constexpr std::array kLasting = {1, 2, 5, 10, 20, 60};

/// Of a feature of track windows: lower edges of the bins of its distribution, the first open to below; and what makes it
/// about 0 and 1 wide where features are multiplied.
struct FeatureScale {
  std::vector<double> edges;
  double middle, width;
};
/// In the order of feature_names().
const std::array kFeatures = {FeatureScale{{0, 20, 35, 50, 60, 70, 80, 90, 100}, 65, 25},
                              FeatureScale{{0, 15, 20, 25, 30, 35, 40}, 28, 10},
                              FeatureScale{{0, 0.01, 0.1, 0.2, 0.4, 0.7}, 0.1, 0.17},
                              FeatureScale{{0, 0.5, 1.5, 2.5, 4.5, 8.5}, 0.7, 1.3},
                              FeatureScale{{0, 0.4, 0.8, 1.2, 1.6}, 1, 0.65},
                              FeatureScale{{0, 0.15, 0.3, 0.45, 0.6}, 0.35, 0.3},
                              FeatureScale{{-4, -1, -0.4, 0, 0.4, 1}, 0, 0.85},
                              FeatureScale{{0, 100, 200, 300, 400, 600}, 305, 225},
                              FeatureScale{{0, 150, 300, 400, 500, 650}, 465, 245},
                              FeatureScale{{0, 0.01, 0.15, 0.35, 0.65, 0.95}, 0.17, 0.3},
                              FeatureScale{{0, 70, 120, 180, 250, 320, 400}, 230, 125},
                              FeatureScale{{0, 1.5, 3.5, 5.5, 7.5}, 4.4, 2.9}};

enum Group : std::size_t {
  kStep,
  kMsd,
  kWall,
  kRing,
  kTime,
  kTurn,
  kBias,
  kSpeed,
  kStillOpen,
  kStillWall,
  kCrowd,
  kDirection,
  kPlace,
  kRim,
  kDrift,
  kReports,
  kStay,
  kMiddle,
  kExtent,
  kShareX,
  kShareY,
  kInwardX,
  kInwardY,
  kSpeedLasts,
  kTurnLasts,
  kWindows,  ///< the first of one group per feature
  kPairs = kWindows + 12,
};

std::vector<StatisticGroup> make_groups() {
  std::vector<StatisticGroup> groups;
  const auto add = [&](std::string name, std::string covariate, std::vector<std::string> labels) {
    const std::size_t first = groups.empty() ? 0 : groups.back().first + groups.back().size();
    groups.push_back({std::move(name), std::move(covariate), std::move(labels), first});
  };
  const auto each = [](const auto& values, const char* format) {
    std::vector<std::string> labels;
    for (const auto v : values) labels.push_back(fmt::format(fmt::runtime(format), v));
    return labels;
  };
  const auto counted = [](std::size_t n, const char* format) {
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < n; ++i) labels.push_back(fmt::format(fmt::runtime(format), i));
    return labels;
  };
  std::vector<int> lags_s;
  for (const int lag : kLags) lags_s.push_back(lag * 10);
  add("step", "history", each(kSteps_mm, "from {} mm in 10 s"));
  add("msd", "history", each(lags_s, "root mean square way in {} s, mm"));
  add("step-by-wall", "position", each(kWalls_mm, "mean step from {} mm off the wall, mm"));
  add("occupancy", "position", counted(kRings, "ring {}"));
  add("step-by-time", "time", counted(kTimeBins, "mean step in 5 minutes {}, mm"));
  add("turn", "history", counted(kTurns, "eighth {} of 0..pi"));
  add("turn-bias", "robot", {"mean", "between robots", "in halves"});
  add("speed", "robot", {"mean", "between robots", "in halves"});
  add("still-in-the-open", "history", each(kOpenRuns, "episodes of {} blocks or more, in 1000"));
  add("still-beside-walls", "position", each(kWallRuns, "episodes of {} blocks or more, in 1000"));
  add("step-by-neighbours", "neighbours", counted(kNeighbours, "{} within 100 mm"));
  add("step-by-direction", "world_frame", counted(kSectors, "eighth {} of the compass"));
  add("step-by-place", "position", counted(kColumns * kRows, "place {}"));
  add("occupancy-of-the-rim", "position", counted(kRimParts, "part {}"));
  add("drift", "world_frame", {"x", "y"});
  add("reports", "measurement",
      {"blocks unheard", "heard again after 2 s", "heard twice at once", "cell as before", "next to it",
       "blocks unheard, between robots", "as many cells on as before", "blocks without any report",
       "unheard after such a block"});
  add("stays-beside-walls", "position", each(kStays, "stays of {} blocks or more, in 1000"));
  add("middle-by-time", "time", counted(kMiddleBins, "share in the middle in 10 minutes {}"));
  add("extent", "robot", {"mean", "between robots", "in halves"});
  add("occupancy-along-x", "position", counted(kAcross, "tenth {}"));
  add("occupancy-along-y", "position", counted(kAcross, "tenth {}"));
  add("way-to-the-middle-along-x", "position", counted(kToMiddle, "in 100 s from fifth {}, of the middle, mm"));
  add("way-to-the-middle-along-y", "position", counted(kToMiddle, "in 100 s from fifth {}, of the middle, mm"));
  std::vector<int> lasting_s;
  for (const int lag : kLasting) lasting_s.push_back(lag * 10);
  add("speed-lasts", "history", each(lasting_s, "steps' product after {} s"));
  add("turning-lasts", "history", each(lasting_s, "turns' product after {} s"));
  const std::vector<std::string>& features = feature_names();
  for (std::size_t f = 0; f < kFeatures.size(); ++f)
    add("windows: " + features[f], "history", each(kFeatures[f].edges, "from {}"));
  std::vector<std::string> pairs;
  for (std::size_t f = 0; f < features.size(); ++f) {
    for (std::size_t g = 0; g < f; ++g) pairs.push_back(features[f] + " with " + features[g]);
  }
  add("windows: pairs", "history", std::move(pairs));
  return groups;
}

/// Adds up what one robot contributes.
class Sums {
 public:
  Sums() : sums_{std::vector<double>(statistic_count(), 0), std::vector<double>(statistic_count(), 0)} {}
  void add(Group group, std::size_t i, double value, double weight = 1) {
    const std::size_t at = statistic_groups()[group].first + i;
    sums_.sum[at] += value * weight;
    sums_.weight[at] += weight;
  }
  /// Counts what falls into bin `hit` of `bins`.
  void count(Group group, std::size_t hit, std::size_t bins) {
    for (std::size_t i = 0; i < bins; ++i) add(group, i, i == hit ? 1 : 0);
  }
  [[nodiscard]] RobotSums take() { return std::move(sums_); }

 private:
  RobotSums sums_;
};

/// The last bin whose lower edge is not above `value`.
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

/// Two halves of a run tell what lasts from what is chance: their product has the variance of what lasts.
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
      for (std::size_t i = 0; i < kRimParts; ++i)
        sums.add(kRim, i, wall_mm < kAlong_mm && rim_part(floor_, x_[k], y_[k]) == i ? 1 : 0);
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

  /// How far it goes towards the middle line of the floor, from how far off.
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

  /// Episodes of blocks in which the robot hardly moved, per 1000 blocks spent there; unheard blocks are passed over.
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

  /// Stays beside a wall, per 1000 blocks; unheard blocks are passed over.
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

/// Of reports to three cells of one module, each 2 s after the other: whether the module went on by as many cells again.
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
  std::optional<std::size_t> first;  // of the reports at the time before
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

/// What a classifier sees, and how its numbers go together.
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

/// How many others were within reach in each block.
std::vector<std::vector<std::size_t>> count_neighbours(const FloorBlocks& blocks) {
  std::vector<std::vector<std::size_t>> all(blocks.robots(), std::vector<std::size_t>(blocks.blocks, 0));
  for (std::size_t k = 0; k < blocks.blocks; ++k) {
    for (std::size_t a = 0; a < blocks.robots(); ++a) {
      for (std::size_t b = a + 1; b < blocks.robots(); ++b) {
        const double dx = blocks.x_mm[a][k] - blocks.x_mm[b][k], dy = blocks.y_mm[a][k] - blocks.y_mm[b][k];
        if (!(dx * dx + dy * dy < kNear_mm * kNear_mm)) continue;  // also where one is not known
        ++all[a][k];
        ++all[b][k];
      }
    }
  }
  return all;
}

}  // namespace

const std::vector<StatisticGroup>& statistic_groups() {
  static const std::vector<StatisticGroup> groups = make_groups();
  return groups;
}

const StatisticGroup& statistic_group(std::string_view name) {
  const auto& groups = statistic_groups();
  return *std::find_if(groups.begin(), groups.end(), [&](const StatisticGroup& g) { return g.name == name; });
}

std::size_t statistic_count() { return statistic_groups().back().first + statistic_groups().back().size(); }

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
    // A mean of a few robots says nothing of its own uncertainty.
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

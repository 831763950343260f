#include "clients/identify/data/data_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "clients/identify/data/command_response.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

double distance(const Sample& a, const Sample& b) { return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm); }
bool same_place(const Sample& a, const Sample& b) { return a.x_mm == b.x_mm && a.y_mm == b.y_mm; }

/// Removes the marked samples from a track. Returns their number.
std::size_t take_out(Track& track, const std::vector<bool>& out) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < track.samples.size(); ++k) {
    if (!out[k]) track.samples[kept++] = track.samples[k];
  }
  const std::size_t gone = track.samples.size() - kept;
  track.samples.resize(kept);
  return gone;
}

// --- duplicates ---

// Discs are 33 mm wide. Two tracked points this close belong to one robot, whichever point of the robot the
// tracker follows.
constexpr double kOneRobot_mm = 12;
// Fewest common samples, and the fewest share of them that are this close.
constexpr std::size_t kFewestCommon = 10;
constexpr double kShareCommon = 0.5;

struct Common {
  std::size_t count = 0, together = 0;
  std::vector<double> distance_mm;
};

Common compare(const Track& a, const Track& b) {
  Common common;
  std::size_t j = 0;
  for (const Sample& sample : a.samples) {
    while (j < b.samples.size() && b.samples[j].time_s < sample.time_s - 1e-6) ++j;
    if (j == b.samples.size()) break;
    if (b.samples[j].time_s > sample.time_s + 1e-6) continue;
    ++common.count;
    common.distance_mm.push_back(distance(sample, b.samples[j]));
    if (common.distance_mm.back() < kOneRobot_mm) ++common.together;
  }
  return common;
}

}  // namespace

void exclude_duplicates(MeasuredSet& set, std::vector<DataFault>& faults) {
  std::map<std::uint32_t, std::size_t> runs_of;  // number of runs in which each robot occurs
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) ++runs_of[track.robot];
  }
  for (Run& run : set.runs) {
    for (std::size_t a = 0; a < run.tracks.size(); ++a) {
      for (std::size_t b = a + 1; b < run.tracks.size(); ++b) {
        if (run.tracks[a].samples.empty() || run.tracks[b].samples.empty()) continue;
        const Common common = compare(run.tracks[a], run.tracks[b]);
        if (common.together < kFewestCommon ||
            static_cast<double>(common.together) < kShareCommon * static_cast<double>(common.count))
          continue;
        // The copy is the number that occurs in fewer runs. On a tie it is the higher number.
        const bool first = runs_of[run.tracks[a].robot] < runs_of[run.tracks[b].robot];
        Track& copy = run.tracks[first ? a : b];
        const Track& origin = run.tracks[first ? b : a];
        faults.push_back({DataFault::Kind::kDuplicate, run.name, copy.robot, origin.robot,
                          copy.samples.front().time_s, copy.samples.back().time_s,
                          stats::upper_median(common.distance_mm), copy.samples.size()});
        copy.samples.clear();
      }
    }
  }
}

// --- frozen ---

namespace {

// The tracker is frozen if a robot commanded to move repeats its position, to the last digit, for this time.
constexpr double kFrozen_s = 4;
constexpr std::size_t kFewestFrozen = 4;
// Trackers that round, or that report cells, repeat positions anyway. If robots at rest repeat a larger share of
// their positions than this, repeats carry no evidence.
constexpr double kRepeats = 0.2;

/// Share of positions that repeat the previous one, of robots at rest.
double repeats_at_rest(const MeasuredSet& set) {
  std::size_t rest = 0, same = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (std::size_t k = 1; k < track.samples.size(); ++k) {
        if (command_at(track, track.samples[k - 1].time_s) != Motion::kStop ||
            command_at(track, track.samples[k].time_s) != Motion::kStop)
          continue;
        ++rest;
        if (same_place(track.samples[k - 1], track.samples[k])) ++same;
      }
    }
  }
  return rest == 0 ? 0 : static_cast<double>(same) / static_cast<double>(rest);
}

/// Share of all steps that repeat the position, where a repeat of more than kFrozen_s counts once: the rate of
/// repeats by rounding.
double isolated_repeats(const MeasuredSet& set) {
  std::size_t steps = 0, same = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (std::size_t k = 1, begin = 0; k < track.samples.size(); ++k) {
        ++steps;
        if (!same_place(track.samples[k - 1], track.samples[k])) {
          begin = k;
        } else if (track.samples[k].time_s - track.samples[begin].time_s < kFrozen_s) {
          ++same;
        }
      }
    }
  }
  return steps == 0 ? 0 : static_cast<double>(same) / static_cast<double>(steps);
}

}  // namespace

void exclude_frozen(MeasuredSet& set, std::vector<DataFault>& faults) {
  if (repeats_at_rest(set) > kRepeats || isolated_repeats(set) > kRepeats) return;
  for (Run& run : set.runs) {
    for (Track& track : run.tracks) {
      std::vector<bool> out(track.samples.size());
      std::size_t end = 0;
      const auto frozen_s = [&](std::size_t begin) {
        end = begin + 1;
        double driven_s = 0;
        while (end < track.samples.size() && same_place(track.samples[begin], track.samples[end])) {
          const double from_s = track.samples[end - 1].time_s, to_s = track.samples[end].time_s;
          if (command_at(track, 0.5 * (from_s + to_s)) != Motion::kStop) driven_s += to_s - from_s;
          ++end;
        }
        return driven_s;
      };
      for (std::size_t begin = 0; begin < track.samples.size(); begin = end) {
        if (frozen_s(begin) < kFrozen_s || end - begin < kFewestFrozen) continue;
        // The first sample of the interval is valid.
        for (std::size_t k = begin + 1; k < end; ++k) out[k] = true;
        faults.push_back({DataFault::Kind::kFrozen, run.name, track.robot, std::nullopt,
                          track.samples[begin].time_s, track.samples[end - 1].time_s, 0, end - begin - 1});
      }
      take_out(track, out);
    }
  }
}

// --- outliers ---

namespace {

// A position is an outlier if it deviates from three predictions: the extrapolation from before, that from after, and
// the interpolation. Each distance must be this many of its robust standard deviations in the run. The speeds towards
// it and away from it must also exceed the 95th percentile of speeds by this factor.
constexpr double kOutlierSds = 12;
constexpr double kLeastOutlier_mm = 6;
constexpr double kTooFast = 1.5;
constexpr int kOutlierPasses = 3;
// Longest interval over which positions are extrapolated.
constexpr double kLongestStep_s = 2.5;

/// Distance of sample k from the position interpolated from its neighbours in time, mm. 0 at the ends and beside
/// gaps.
double off_course_mm(const std::vector<Sample>& s, std::size_t k) {
  if (k < 2 || k + 2 >= s.size() || s[k + 2].time_s - s[k - 2].time_s > 4 * kLongestStep_s) return 0;
  const auto from_line = [&](std::size_t a, std::size_t b) {
    const double span = s[b].time_s - s[a].time_s;
    if (span <= 0) return 0.0;
    const double u = (s[k].time_s - s[a].time_s) / span;
    return std::hypot(s[a].x_mm + u * (s[b].x_mm - s[a].x_mm) - s[k].x_mm,
                      s[a].y_mm + u * (s[b].y_mm - s[a].y_mm) - s[k].y_mm);
  };
  return std::min({from_line(k - 2, k - 1), from_line(k + 1, k + 2), from_line(k - 1, k + 1)});
}

struct Bounds {
  double off_mm, speed_mm_s;
};

/// Distance of sample k from its predicted position if k is an outlier, else 0, mm.
double outlier_mm(const std::vector<Sample>& s, std::size_t k, const Bounds& bounds) {
  const double off = off_course_mm(s, k);
  if (off < bounds.off_mm) return 0;
  const auto too_far = [&](std::size_t a, std::size_t b) {
    return distance(s[a], s[b]) > bounds.speed_mm_s * (s[b].time_s - s[a].time_s) + 0.5 * bounds.off_mm;
  };
  return too_far(k - 1, k) && too_far(k, k + 1) ? off : 0;
}

}  // namespace

void exclude_outliers(MeasuredSet& set, std::vector<DataFault>& faults) {
  for (Run& run : set.runs) {
    std::vector<double> course, speeds;
    for (const Track& track : run.tracks) {
      for (std::size_t k = 0; k < track.samples.size(); ++k) {
        if (const double off = off_course_mm(track.samples, k); off > 0) course.push_back(off);
        if (k == 0) continue;
        const double dt = track.samples[k].time_s - track.samples[k - 1].time_s;
        if (dt > 0 && dt <= kLongestStep_s) speeds.push_back(distance(track.samples[k - 1], track.samples[k]) / dt);
      }
    }
    // Sampled more slowly, a robot's path between two samples is unknown: no position is an outlier.
    if (course.size() < 20 || speeds.empty()) continue;
    // The length of a two-dimensional normal vector has a median of 1.18 standard deviations.
    const Bounds bounds{std::max(kOutlierSds * stats::upper_median(course) / 1.18, kLeastOutlier_mm),
                        kTooFast * stats::order_statistic(speeds, speeds.size() * 19 / 20)};
    DataFault fault{DataFault::Kind::kOutliers,
                    run.name,
                    std::nullopt,
                    std::nullopt,
                    std::numeric_limits<double>::infinity(),
                    -std::numeric_limits<double>::infinity(),
                    0,
                    0};
    std::size_t robots = 0;
    for (Track& track : run.tracks) {
      std::size_t of_track = 0;
      for (int pass = 0; pass < kOutlierPasses; ++pass) {
        std::vector<bool> out(track.samples.size());
        // One at a time, the worst of a neighbourhood first: a good position beside an outlier looks bad.
        for (std::size_t k = 0; k < track.samples.size(); ++k) {
          const double off = outlier_mm(track.samples, k, bounds);
          if (off == 0) continue;
          const bool worst = (k == 0 || off >= outlier_mm(track.samples, k - 1, bounds)) &&
                             (k + 1 == track.samples.size() || off > outlier_mm(track.samples, k + 1, bounds));
          if (!worst) continue;
          out[k] = true;
          fault.from_s = std::min(fault.from_s, track.samples[k].time_s);
          fault.to_s = std::max(fault.to_s, track.samples[k].time_s);
          fault.strength = std::max(fault.strength, off);
        }
        const std::size_t gone = take_out(track, out);
        of_track += gone;
        if (gone == 0) break;
      }
      if (of_track > 0) {
        ++robots;
        fault.robot = track.robot;
        fault.excluded += of_track;
      }
    }
    if (robots > 1) fault.robot.reset();
    if (fault.excluded > 0) faults.push_back(fault);
  }
}

// --- all kinds ---

std::vector<DataFault> exclude_faults(MeasuredSet& set) {
  std::vector<DataFault> faults;
  exclude_duplicates(set, faults);
  exclude_frozen(set, faults);
  exclude_wrong_clocks(set, faults);
  exclude_swapped(set, faults);
  exclude_outliers(set, faults);
  std::map<std::string, std::size_t> place;
  for (std::size_t r = 0; r < set.runs.size(); ++r) place.emplace(set.runs[r].name, r);
  std::stable_sort(faults.begin(), faults.end(), [&](const DataFault& a, const DataFault& b) {
    return std::pair(place[a.run], a.kind) < std::pair(place[b.run], b.kind);
  });
  return faults;
}

const char* name_of(DataFault::Kind kind) {
  constexpr std::array kNames = {"outliers", "frozen", "duplicate", "swapped", "clock"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string DataFault::in_words() const {
  const std::string who = robot ? fmt::format("robot {}", *robot) : "several robots";
  const std::string where = fmt::format("{}un {}", of_test ? "Test data, r" : "R", run);
  const auto consequence = [&](const std::string& excluded_ones) {
    return of_test ? std::string("The error on the test data contains it.") : excluded_ones;
  };
  const std::string positions = fmt::format("{} positions excluded.", excluded);
  switch (kind) {
    case Kind::kOutliers:
      return fmt::format("{}: {} outlier{} of {}, up to {:.0f} mm away from where {} before and after. {}", where,
                         excluded, excluded == 1 ? "" : "s", who, strength, robot ? "it was" : "they were",
                         consequence("Excluded."));
    case Kind::kFrozen:
      return fmt::format(
          "{}: the position of {} is frozen from {:.1f} to {:.1f} s, to the last digit, while it was commanded "
          "to move. {}",
          where, who, from_s, to_s, consequence(positions));
    case Kind::kDuplicate:
      return fmt::format("{}: robot {} is a second track of robot {}, at {:.1f} mm (discs are 33 mm wide). {}",
                         where, *robot, *other, strength, consequence("Its " + positions));
    case Kind::kSwapped:
      return fmt::format(
          "{}: the numbers of robots {} and {} are swapped from {:.1f} to {:.1f} s: exchanging their commands "
          "raises the log-likelihood by {:.0f}. {}",
          where, *robot, *other, from_s, to_s, strength, consequence(positions));
    case Kind::kClock:
      return fmt::format(
          "{}: the tracker's clock is wrong: robots follow their commands if its times are divided by {:.4f}. {}",
          where, strength, consequence(fmt::format("The run's {} positions are excluded.", excluded)));
  }
  return {};
}

}  // namespace kilotwin::identify

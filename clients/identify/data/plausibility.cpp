#include "clients/identify/data/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <vector>

#include "clients/identify/data/command_clock.hpp"
#include "clients/identify/data/command_response.hpp"
#include "core/base/error.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

// As core/experiment/limits.hpp. A model with a robot beyond it would be refused.
constexpr std::uint32_t kMostRobots = 100'000;
// Longest plausible run: eleven days.
constexpr double kLongestRun_s = 1e6;
constexpr double kSlowestSampling_s = 60;
// Largest plausible coordinate: one kilometre.
constexpr double kFarthest_mm = 1e6;
// Smallest plausible extent of all positions. Two discs of 33 mm need more.
constexpr double kSmallestRoom_mm = 15;
// Half of a disc's diameter.
constexpr double kHalfDisc_mm = 16.5;
// Kilobots drive at 10 mm/s. Bounds of a plausible median speed.
constexpr double kFastestMedian_mm_s = 150, kSlowestMedian_mm_s = 0.1;
constexpr double kLook_s = 5;
// A run in which robots were seen for less than this share of its time, and that is longer than this, robots times
// seconds, holds several recordings. Its neighbours on a raster of time would not fit into memory.
constexpr double kLeastSeen = 0.05, kMuchTime_s = 2e5;

std::string of(const Run& run, const Track& track) {
  return fmt::format("run {}, robot {}", run.name, track.robot);
}

void demand_robot_numbers(const MeasuredSet& set, const std::string& from) {
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      if (track.robot < kMostRobots) continue;
      throw UserError(
          fmt::format("{}: {}: the simulator takes robot numbers below {}; give the robots smaller numbers", from,
                      of(run, track), kMostRobots));
    }
  }
}

void demand_seconds(const MeasuredSet& set, const std::string& from) {
  std::vector<double> steps;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (const Sample& s : track.samples) {
        if (std::abs(s.time_s) > kLongestRun_s)
          throw UserError(
              fmt::format("{}: {}: time_s is {:g}; give seconds since the start of the run (not since 1970, "
                          "nor milliseconds)",
                          from, of(run, track), s.time_s));
      }
      for (std::size_t i = 1; i < track.samples.size(); ++i)
        steps.push_back(track.samples[i].time_s - track.samples[i - 1].time_s);
    }
  }
  if (steps.size() < 5) return;
  const double step = stats::upper_median(steps);
  if (step > kSlowestSampling_s)
    throw UserError(fmt::format(
        "{}: the sampling interval is {:g} s; give time_s in seconds (not milliseconds or frames), about one "
        "sample per second",
        from, step));
}

void demand_one_recording_per_run(const MeasuredSet& set, const std::string& from) {
  for (const Run& run : set.runs) {
    double first_s = 1e300, last_s = -1e300, seen_s = 0;
    for (const Track& track : run.tracks) {
      for (std::size_t i = 0; i < track.samples.size(); ++i) {
        first_s = std::min(first_s, track.samples[i].time_s);
        last_s = std::max(last_s, track.samples[i].time_s);
        if (i > 0) seen_s += std::min(track.samples[i].time_s - track.samples[i - 1].time_s, kSlowestSampling_s);
      }
    }
    const double time_s = (last_s - first_s) * static_cast<double>(run.tracks.size());
    if (time_s > kMuchTime_s && seen_s < kLeastSeen * time_s)
      throw UserError(fmt::format(
          "{}: run {}: robots were seen for {:.2g} % of its {:g} s; give each recording a run of its own, with "
          "time_s from its start",
          from, run.name, 100 * seen_s / time_s, last_s - first_s));
  }
}

void demand_millimetres(const MeasuredSet& set, const std::string& from) {
  for (const Run& run : set.runs) {
    double low_x = 1e300, high_x = -1e300, low_y = 1e300, high_y = -1e300;
    std::size_t samples = 0;
    for (const Track& track : run.tracks) {
      for (const Sample& s : track.samples) {
        if (std::abs(s.x_mm) > kFarthest_mm || std::abs(s.y_mm) > kFarthest_mm)
          throw UserError(
              fmt::format("{}: {}: x_mm, y_mm are {:g}, {:g}; give mm", from, of(run, track), s.x_mm, s.y_mm));
        low_x = std::min(low_x, s.x_mm), high_x = std::max(high_x, s.x_mm);
        low_y = std::min(low_y, s.y_mm), high_y = std::max(high_y, s.y_mm);
        ++samples;
      }
    }
    if (run.tracks.size() > 1 && samples > 10 && high_x - low_x < kSmallestRoom_mm &&
        high_y - low_y < kSmallestRoom_mm)
      throw UserError(
          fmt::format("{}: run {}: {} robots, 33 mm wide each, within {:.3g} mm x {:.3g} mm; give x_mm and y_mm "
                      "in mm (not metres), or state the unit: --unit-mm 1000",
                      from, run.name, run.tracks.size(), high_x - low_x, high_y - low_y));
  }
}

void demand_radians(const MeasuredSet& set, const std::string& from) {
  std::size_t all = 0, beyond = 0;
  double most = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (const Sample& s : track.samples) {
        if (std::isnan(s.heading_rad)) continue;
        ++all;
        if (std::abs(s.heading_rad) > 2 * M_PI) ++beyond;
        most = std::max(most, std::abs(s.heading_rad));
      }
    }
  }
  // Headings may count on beyond a full turn, but then they do not end at 360.
  if (all > 10 && beyond * 3 > all && most > 90 && most < 361)
    throw UserError(
        fmt::format("{}: heading_rad is up to {:g}; give radians (not degrees), or --angle deg", from, most));
}

void demand_motion(const MeasuredSet& set, const std::string& from) {
  std::vector<double> speeds;
  bool driven = false;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      if (track.samples.size() < 2) continue;
      const CommandClock clock(track);
      for (std::size_t i = 0; i + 1 < track.samples.size();) {
        std::size_t j = i + 1;
        while (j + 1 < track.samples.size() && track.samples[j].time_s < track.samples[i].time_s + kLook_s) ++j;
        const Sample &a = track.samples[i], &b = track.samples[j];
        const CommandState at = clock.at(a.time_s);
        const double lasts_s = b.time_s - a.time_s;
        i = j;
        if (!at.driven()) {
          driven = driven || clock.next_change_s(a.time_s) < b.time_s;
          continue;
        }
        driven = true;
        if (lasts_s > 0) speeds.push_back(std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm) / lasts_s);
      }
    }
  }
  if (!driven)
    throw UserError(fmt::format(
        "{}: no tracked robot is commanded to move; use the runs and robots of trajectories.csv in commands.csv, "
        "or omit it if robots always drive straight",
        from));
  if (speeds.size() < 5) return;
  const double speed = stats::upper_median(speeds);
  if (speed > kFastestMedian_mm_s)
    throw UserError(fmt::format(
        "{}: robots drive at {:.3g} mm/s, Kilobots at about 10 mm/s; give x_mm and y_mm in mm (not pixels), or the "
        "length of a unit: --unit-mm MM; time_s in seconds",
        from, speed));
  if (speed < kSlowestMedian_mm_s)
    throw UserError(fmt::format(
        "{}: commanded robots drive at {:.3g} mm/s, Kilobots at about 10 mm/s; give x_mm and y_mm "
        "in mm (not metres), or --unit-mm 1000; time_s in seconds (not milliseconds), or --unit-s 0.001",
        from, speed));
}

/// In a picture y points down, and turns then have the wrong sign. Robots that turn against their commands show it.
void demand_plane_axes(const MeasuredSet& set, const std::string& from) {
  if (!set.has_commands) return;
  std::size_t with = 0, against = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      for (const MotionSegment& segment : segments_of(track)) {
        const Motion motion = command_at(track, segment.time_s);
        // Both neighbours of the segment under the same command: a turn of its own.
        constexpr double kAround_s = 1.5;
        if ((motion != Motion::kLeft && motion != Motion::kRight) ||
            command_at(track, segment.time_s - kAround_s) != motion ||
            command_at(track, segment.time_s + kAround_s) != motion)
          continue;
        ++((segment.curve_mm2_s2 > 0) == (motion == Motion::kLeft) ? with : against);
      }
    }
  }
  constexpr std::size_t kFewestTurns = 20;  // turns; with fewer, chance could refuse good data
  // A faulty wheel may turn a robot against its commands, but not nearly all robots.
  if (with + against >= kFewestTurns && against > 4 * with)
    throw UserError(
        fmt::format("{}: in {} of {} turns the robots turn against their commands; give y upwards and headings "
                    "anticlockwise, or "
                    "state that the axes are those of a picture: --frame image",
                    from, against, with + against));
}

/// Discs of 33 mm cannot overlap by half: positions in centimetres look so.
void demand_room(const MeasuredSet& set, const std::string& from) {
  // Interval of the instants, and sightings at all of them, from which on data are judged. Fewer sightings could refuse
  // good data by chance; more would let short recordings pass.
  constexpr double kInstant_s = 10, kFewestRobots = 12;
  std::size_t robots = 0, overlap = 0;
  for (const Run& run : set.runs) {
    // The first sample of each robot in each second that begins an instant.
    std::map<long, std::vector<const Sample*>> instants;
    for (const Track& track : run.tracks) {
      long last = -1;
      for (const Sample& s : track.samples) {
        const long instant = std::lround(std::floor(s.time_s / kInstant_s));
        if (s.time_s - kInstant_s * static_cast<double>(instant) >= 1 || instant == last) continue;
        instants[instant].push_back(&s);
        last = instant;
      }
    }
    for (const auto& [instant, seen] : instants) {
      for (const Sample* const one : seen) {
        ++robots;
        overlap += std::any_of(seen.begin(), seen.end(), [&](const Sample* other) {
          return other != one && std::hypot(other->x_mm - one->x_mm, other->y_mm - one->y_mm) < kHalfDisc_mm;
        });
      }
    }
  }
  if (static_cast<double>(robots) >= kFewestRobots && 2 * overlap > robots)
    throw UserError(
        fmt::format("{}: {} % of the robots, 33 mm wide each, are within {:g} mm of another; give x_mm and y_mm in "
                    "mm (not centimetres), or state the unit: --unit-mm 10",
                    from, 100 * overlap / robots, kHalfDisc_mm));
}

/// Headings of robots that drive straight are the directions of their motion.
void demand_headings_of_motion(const MeasuredSet& set, const std::string& from) {
  // Duration and least way of a drive, and drives from which on data are judged. Over shorter ways, noise decides the
  // direction; with fewer drives, chance could refuse good data.
  constexpr double kLasts_s = 2, kMoved_mm = 5, kFewestDrives = 20;
  // Mean resultant lengths, 0..1, and a turn beyond which no camera or marker is turned unwittingly.
  constexpr double kAgree = 0.9, kDisagree = 0.5, kMuch_rad = M_PI / 3;
  std::complex<double> behind = 0, mirrored = 0;
  double count = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      const CommandClock clock(track);
      for (std::size_t i = 0, j = 0; i < track.samples.size(); i = j) {
        for (j = i + 1; j < track.samples.size() && track.samples[j].time_s < track.samples[i].time_s + kLasts_s;)
          ++j;
        if (j >= track.samples.size()) break;
        const Sample &a = track.samples[i], &b = track.samples[j];
        const double dx_mm = b.x_mm - a.x_mm, dy_mm = b.y_mm - a.y_mm;
        if (std::isnan(a.heading_rad) || clock.at(a.time_s).command != Motion::kStraight ||
            clock.next_change_s(a.time_s) < b.time_s || std::hypot(dx_mm, dy_mm) < kMoved_mm)
          continue;
        const double direction = std::atan2(dy_mm, dx_mm);
        behind += std::polar(1.0, a.heading_rad - direction);
        mirrored += std::polar(1.0, a.heading_rad + direction);
        count += 1;
      }
    }
  }
  if (count < kFewestDrives) return;
  if (std::abs(behind) < kDisagree * count && std::abs(mirrored) > kAgree * count)
    throw UserError(
        fmt::format("{}: heading_rad turns against the motion of robots that drive straight; give headings "
                    "anticlockwise (their "
                    "negatives)",
                    from));
  if (std::abs(behind) > kAgree * count && std::abs(std::arg(behind)) > kMuch_rad)
    throw UserError(
        fmt::format("{}: heading_rad points {:.0f} degrees to the {} of the motion of robots that drive straight; "
                    "give the heading "
                    "of the front, 0 along x",
                    from, std::abs(std::arg(behind)) * 180 / M_PI, std::arg(behind) > 0 ? "left" : "right"));
}

}  // namespace

void demand_plausible(const MeasuredSet& set, const std::string& from) {
  demand_robot_numbers(set, from);
  demand_seconds(set, from);
  demand_one_recording_per_run(set, from);
  demand_millimetres(set, from);
  demand_radians(set, from);
  demand_motion(set, from);
  demand_plane_axes(set, from);
  demand_room(set, from);
  demand_headings_of_motion(set, from);
}

void demand_longer_than(const MeasuredSet& set, double horizon_s, bool held_out_only, const std::string& from) {
  double longest_s = 0;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) {
      if (track.samples.empty() || (held_out_only && !track.held_out)) continue;
      // A prediction needs samples one horizon before its time.
      if (track.samples.front().time_s <= track.samples.back().time_s - horizon_s)
        longest_s = std::max(longest_s, track.samples.back().time_s);
    }
  }
  if (longest_s >= horizon_s) return;
  throw UserError(
      fmt::format("{}: no track is as long as the horizon of {:g} s; give a shorter one with --horizon, or "
                  "longer runs",
                  from, horizon_s));
}

}  // namespace kilotwin::identify

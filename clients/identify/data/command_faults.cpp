// Faults of the assignment between commands and tracks: swapped robot numbers and wrong clocks.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "clients/identify/data/command_response.hpp"
#include "clients/identify/data/data_faults.hpp"

namespace kilotwin::identify {
namespace {

// --- clocks ---

constexpr double kSlowestClock = 0.5, kFastestClock = 2;  // rates that are tried; clocks beyond them are not found
// Grid of clock rates: neighbouring rates move the end of the compared interval by this time.
constexpr double kStep_s = 0.4;
// A run's clock is wrong if another rate passes four bounds: gain in log-likelihood per robot and hundred motion
// segments, total gain, shift of the run's end, and the total gain in standard errors over robots. Of a right clock, another rate
// suits some robots by chance, and suits others badly.
constexpr double kClockGainShare = 0.08, kClockGain = 60, kClockShift_s = 3, kClockErrors = 3;
// Upper bound on the robots of a run whose tracks are used to estimate its clock rate.
constexpr std::size_t kClockTracks = 16;

struct ClockTrack {
  const Track* track;
  std::vector<MotionSegment> segments;
};

/// 0 of a single value, which tells none.
double standard_error_of_sum(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return n < 2 ? 0 : std::sqrt(squares * n / (n - 1));
}

/// Log-likelihood of all motion segments before `until_s` (stamped time) if stamped time is `rate` times true
/// time.
double of_rate(const std::vector<ClockTrack>& clock_tracks, const CommandResponse& response, double rate,
               double until_s) {
  double sum = 0;
  for (const ClockTrack& w : clock_tracks) {
    for (const MotionSegment& segment : w.segments) {
      if (segment.time_s > until_s) break;
      sum += response.log_likelihood(segment, command_at(*w.track, segment.time_s / rate));
    }
  }
  return sum;
}

/// Maximum-likelihood clock rate: a coarse grid over the beginning of the run, then finer grids over longer
/// intervals.
double best_rate(const std::vector<ClockTrack>& clock_tracks, const CommandResponse& response, double end_s) {
  double low = kSlowestClock, high = kFastestClock, best = 1;
  double until_s = std::min(60.0, end_s);
  for (;;) {
    const double step = kStep_s / until_s;
    double best_sum = -1e300;
    const auto rates = static_cast<int>(std::floor((high - low) / step + 0.5)) + 1;
    for (int i = 0; i < rates; ++i) {
      const double rate = low + i * step;
      const double sum = of_rate(clock_tracks, response, rate, until_s);
      if (sum > best_sum) {
        best_sum = sum;
        best = rate;
      }
    }
    low = best - 4 * step;
    high = best + 4 * step;
    if (until_s >= end_s) return best;
    until_s = std::min(2 * until_s, end_s);
  }
}

// --- swapped robot numbers ---

// Bounds for a swap: total gain in log-likelihood, number of motion segments, and gain of each of the two robots.
constexpr double kSwapGain = 100;
constexpr std::size_t kFewestSwapped = 16;
constexpr double kSwapGainEach = 0.5;
// A robot that deviates from the common response (faster at first, say) may fit any other robot's commands better
// than its own. The gain by the partner's commands must exceed the gain by anybody else's by this factor.
constexpr double kSwapDistinct = 2;
// If two robots appear at each other's last position within one sampling interval, their numbers were exchanged.
// Bounds: the speed that a robot cannot reach, the longest interval, and the slack for tracker noise.
constexpr double kFastest_mm_s = 35, kExchangeStep_s = 3, kSlack_mm = 4;

struct Gain {
  double time_s, gain;
};

/// Gain in log-likelihood of each motion segment if `track` followed the commands of `other`.
std::vector<Gain> gains(const std::vector<MotionSegment>& segments, const Track& track, const Track& other,
                        const CommandResponse& response) {
  std::vector<Gain> out;
  for (const MotionSegment& segment : segments) {
    const Motion own = command_at(track, segment.time_s), others = command_at(other, segment.time_s);
    const double gain =
        own == others ? 0 : response.log_likelihood(segment, others) - response.log_likelihood(segment, own);
    out.push_back({segment.time_s, gain});
  }
  return out;
}

struct TimeInterval {
  double gain = 0, from_s = 0, to_s = 0;
  std::size_t count = 0;
};

/// The time interval with the largest total gain (maximum subarray).
TimeInterval best_interval(std::vector<Gain> of_both) {
  std::stable_sort(of_both.begin(), of_both.end(),
                   [](const Gain& a, const Gain& b) { return a.time_s < b.time_s; });
  TimeInterval best, now;
  for (const Gain& g : of_both) {
    if (now.gain <= 0) now = {0, g.time_s, g.time_s, 0};
    now.gain += g.gain;
    now.to_s = g.time_s;
    if (g.gain != 0) ++now.count;
    if (now.gain > best.gain) best = now;
  }
  return best;
}

std::size_t take_out(Track& track, double from_s, double to_s) {
  return std::erase_if(track.samples, [&](const Sample& s) { return s.time_s >= from_s && s.time_s <= to_s; });
}

/// Times at which the numbers of `a` and `b` are exchanged or return: between two samples each robot jumps to the
/// other's position.
std::vector<double> exchanges(const Track& a, const Track& b) {
  std::vector<double> times;
  std::size_t j = 0;
  for (std::size_t i = 1; i < a.samples.size(); ++i) {
    const Sample &before = a.samples[i - 1], &after = a.samples[i];
    const double dt = after.time_s - before.time_s, reach = kFastest_mm_s * dt + kSlack_mm;
    if (dt > kExchangeStep_s || std::hypot(after.x_mm - before.x_mm, after.y_mm - before.y_mm) < 1.4 * reach)
      continue;
    // The other robot's last sample at or before `before`, and its first at or after `after`.
    while (j < b.samples.size() && b.samples[j].time_s <= before.time_s + 1e-6) ++j;
    std::size_t k = j;
    while (k < b.samples.size() && b.samples[k].time_s < after.time_s - 1e-6) ++k;
    if (j == 0 || k == b.samples.size()) continue;
    const Sample &other_before = b.samples[j - 1], &other_after = b.samples[k];
    const auto near = [](const Sample& p, const Sample& q) {
      const double step_s = std::abs(q.time_s - p.time_s);
      return step_s <= kExchangeStep_s &&
             std::hypot(q.x_mm - p.x_mm, q.y_mm - p.y_mm) < kFastest_mm_s * step_s + kSlack_mm;
    };
    if (near(before, other_after) && near(other_before, after) && !near(other_before, other_after))
      times.push_back(before.time_s);
  }
  return times;
}

double gain_between(const std::vector<Gain>& gains, double from_s, double to_s) {
  double sum = 0;
  for (const Gain& g : gains) {
    if (g.time_s > from_s && g.time_s <= to_s) sum += g.gain;
  }
  return sum;
}

/// Numbers exchanged during a run, detected by position.
void exclude_exchanges(Run& run, const CommandResponse& response, std::vector<DataFault>& faults) {
  for (std::size_t a = 0; a < run.tracks.size(); ++a) {
    for (std::size_t b = a + 1; b < run.tracks.size(); ++b) {
      Track &first = run.tracks[a], &second = run.tracks[b];
      std::vector<double> times = exchanges(first, second);
      if (times.empty()) continue;
      std::vector<Gain> both = gains(segments_of(first), first, second, response);
      const std::vector<Gain> of_second = gains(segments_of(second), second, first, response);
      both.insert(both.end(), of_second.begin(), of_second.end());
      // Every second interval is wrong: the intervals whose likelihood rises by the exchange. If the commands are
      // not informative, the second, the fourth...
      const double begin_s = std::min(first.samples.front().time_s, second.samples.front().time_s);
      times.insert(times.begin(), -1e300);
      times.push_back(std::max(first.samples.back().time_s, second.samples.back().time_s));
      std::array<double, 2> gain{};
      for (std::size_t k = 0; k + 1 < times.size(); ++k) gain[k % 2] += gain_between(both, times[k], times[k + 1]);
      const std::size_t wrong = gain[0] > gain[1] ? 0 : 1;
      for (std::size_t k = wrong; k + 1 < times.size(); k += 2) {
        const double from_s = std::max(times[k], begin_s);
        std::size_t gone = 0;
        for (Track* track : {&first, &second})
          gone += take_out(*track, std::nextafter(times[k], 1e300), times[k + 1]);
        faults.push_back({DataFault::Kind::kSwapped, run.name, first.robot, second.robot, from_s, times[k + 1],
                          std::max(gain_between(both, times[k], times[k + 1]), 0.0), gone});
      }
    }
  }
}

/// Gain of each track of a run, over its best interval, by the commands of each other track.
class OthersCommands {
 public:
  OthersCommands(const Run& run, const CommandResponse& response) : run_(run), response_(response) {
    for (const Track& track : run.tracks) segments_.push_back(segments_of(track));
    gains_.assign(run.tracks.size(), std::vector<double>(run.tracks.size()));
    for (std::size_t a = 0; a < run.tracks.size(); ++a) look_at(a);
  }
  /// Recomputes the gains of a track after samples were excluded.
  void look_again(std::size_t a) {
    segments_[a] = segments_of(run_.tracks[a]);
    look_at(a);
  }
  [[nodiscard]] std::vector<Gain> of(std::size_t a, std::size_t b) const {
    return gains(segments_[a], run_.tracks[a], run_.tracks[b], response_);
  }
  /// Whether track `a` follows the commands of `b`, and those of no third robot.
  [[nodiscard]] bool is_like(std::size_t a, std::size_t b) const {
    double other = 0;
    for (std::size_t c = 0; c < gains_.size(); ++c)
      if (c != b) other = std::max(other, gains_[a][c]);
    return gains_[a][b] > std::max(0.25 * kSwapGain, kSwapDistinct * other);
  }

 private:
  void look_at(std::size_t a) {
    for (std::size_t b = 0; b < gains_.size(); ++b)
      if (b != a) gains_[a][b] = best_interval(of(a, b)).gain;
  }

  const Run& run_;
  const CommandResponse& response_;
  std::vector<std::vector<MotionSegment>> segments_;
  std::vector<std::vector<double>> gains_;  ///< [track][track whose commands are used]
};

/// Numbers exchanged from the start or during a gap, detected by the commands.
void exclude_by_commands(Run& run, const CommandResponse& response, std::vector<DataFault>& faults) {
  OthersCommands others(run, response);
  while (true) {
    TimeInterval best;
    std::size_t first = 0, second = 0;
    for (std::size_t a = 0; a < run.tracks.size(); ++a) {
      for (std::size_t b = a + 1; b < run.tracks.size(); ++b) {
        // Both directions must fit: a robot that ignores commands gains by any exchange.
        if (!others.is_like(a, b) || !others.is_like(b, a)) continue;
        std::vector<Gain> both = others.of(a, b);
        const std::vector<Gain> of_b = others.of(b, a);
        both.insert(both.end(), of_b.begin(), of_b.end());
        const TimeInterval interval = best_interval(std::move(both));
        if (interval.count < kFewestSwapped || interval.gain < kSwapGainEach * static_cast<double>(interval.count))
          continue;
        if (interval.gain <= std::max(best.gain, kSwapGain)) continue;
        best = interval;
        first = a;
        second = b;
      }
    }
    if (best.gain <= 0) return;
    // The exchange lies between two informative motion segments: margin at either end.
    constexpr double kDoubt_s = 3;
    std::size_t gone = 0;
    for (const std::size_t k : {first, second}) {
      gone += take_out(run.tracks[k], best.from_s - kDoubt_s, best.to_s + kDoubt_s);
      others.look_again(k);
    }
    faults.push_back({DataFault::Kind::kSwapped, run.name, run.tracks[first].robot, run.tracks[second].robot,
                      best.from_s, best.to_s, best.gain, gone});
  }
}

}  // namespace

void exclude_wrong_clocks(MeasuredSet& set, std::vector<DataFault>& faults) {
  const CommandResponse response(set);
  if (!response.distinguishes_commands()) return;
  for (Run& run : set.runs) {
    std::vector<ClockTrack> clock_tracks;
    double begin_s = 1e300, end_s = 0;
    std::size_t segments = 0, samples = 0;
    for (const Track& track : run.tracks) {
      samples += track.samples.size();
      if (track.commands.size() < 4 || clock_tracks.size() == kClockTracks) continue;
      clock_tracks.push_back({&track, segments_of(track)});
      segments += clock_tracks.back().segments.size();
      if (track.samples.empty()) continue;
      begin_s = std::min(begin_s, track.samples.front().time_s);
      end_s = std::max(end_s, track.samples.back().time_s);
    }
    if (segments < 100 || end_s < 20) continue;
    const double rate = best_rate(clock_tracks, response, end_s);
    std::vector<double> gains;
    gains.reserve(clock_tracks.size());
    for (const ClockTrack& one : clock_tracks)
      gains.push_back(of_rate({one}, response, rate, end_s) - of_rate({one}, response, 1, end_s));
    const double gain = std::accumulate(gains.begin(), gains.end(), 0.0);
    if (!(gain > kClockErrors * standard_error_of_sum(gains)) || gain < kClockGain ||
        gain < kClockGainShare * static_cast<double>(segments) || std::abs(rate - 1) * end_s < kClockShift_s)
      continue;
    faults.push_back(
        {DataFault::Kind::kClock, run.name, std::nullopt, std::nullopt, begin_s, end_s, rate, samples});
    for (Track& track : run.tracks) track.samples.clear();
  }
}

void exclude_swapped(MeasuredSet& set, std::vector<DataFault>& faults) {
  const CommandResponse response(set);
  for (Run& run : set.runs) {
    exclude_exchanges(run, response, faults);
    if (response.distinguishes_commands()) exclude_by_commands(run, response, faults);
  }
}

}  // namespace kilotwin::identify

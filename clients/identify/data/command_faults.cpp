// Faults of the assignment between commands and tracks: swapped robot numbers and wrong clocks.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "clients/identify/data/command_response.hpp"
#include "clients/identify/data/data_faults.hpp"

namespace kilotwin::identify {
namespace {

// --- clocks ---

constexpr double kSlowestClock = 0.5, kFastestClock = 2;
// Grid of clock rates: neighbouring rates move the end of the compared interval by this time.
constexpr double kStep_s = 0.4;
// A run's clock is wrong if another rate passes three bounds: gain in log-likelihood per robot and hundred motion
// segments, total gain, and shift of the run's end.
constexpr double kClockGainShare = 0.08, kClockGain = 60, kClockShift_s = 3;
// Upper bound on the robots of a run whose tracks are used to estimate its clock rate.
constexpr std::size_t kWitnesses = 16;

struct Witness {
  const Track* track;
  std::vector<Deed> deeds;
};

/// Log-likelihood of all motion segments before `until_s` (stamped time) if stamped time is `rate` times true
/// time.
double of_rate(const std::vector<Witness>& witnesses, const ToldAndDone& told, double rate, double until_s) {
  double sum = 0;
  for (const Witness& w : witnesses) {
    for (const Deed& deed : w.deeds) {
      if (deed.time_s > until_s) break;
      sum += told.log_likelihood(deed, told_at(*w.track, deed.time_s / rate));
    }
  }
  return sum;
}

/// Maximum-likelihood clock rate: a coarse grid over the beginning of the run, then finer grids over longer
/// intervals.
double best_rate(const std::vector<Witness>& witnesses, const ToldAndDone& told, double end_s) {
  double low = kSlowestClock, high = kFastestClock, best = 1;
  for (double until_s = std::min(60.0, end_s);; until_s = std::min(2 * until_s, end_s)) {
    const double step = kStep_s / until_s;
    double best_sum = -1e300;
    for (double rate = low; rate <= high + 0.5 * step; rate += step) {
      const double sum = of_rate(witnesses, told, rate, until_s);
      if (sum > best_sum) {
        best_sum = sum;
        best = rate;
      }
    }
    low = best - 4 * step;
    high = best + 4 * step;
    if (until_s >= end_s) return best;
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
std::vector<Gain> gains(const std::vector<Deed>& deeds, const Track& track, const Track& other,
                        const ToldAndDone& told) {
  std::vector<Gain> out;
  for (const Deed& deed : deeds) {
    const Motion own = told_at(track, deed.time_s), others = told_at(other, deed.time_s);
    const double gain = own == others ? 0 : told.log_likelihood(deed, others) - told.log_likelihood(deed, own);
    out.push_back({deed.time_s, gain});
  }
  return out;
}

struct Stretch {
  double gain = 0, from_s = 0, to_s = 0;
  std::size_t count = 0;
};

/// The time interval with the largest total gain (maximum subarray).
Stretch best_stretch(std::vector<Gain> of_both) {
  std::stable_sort(of_both.begin(), of_both.end(),
                   [](const Gain& a, const Gain& b) { return a.time_s < b.time_s; });
  Stretch best, now;
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
void exclude_exchanges(Run& run, const ToldAndDone& told, std::vector<DataFault>& faults) {
  for (std::size_t a = 0; a < run.tracks.size(); ++a) {
    for (std::size_t b = a + 1; b < run.tracks.size(); ++b) {
      Track &first = run.tracks[a], &second = run.tracks[b];
      std::vector<double> times = exchanges(first, second);
      if (times.empty()) continue;
      std::vector<Gain> both = gains(deeds_of(first), first, second, told);
      const std::vector<Gain> of_second = gains(deeds_of(second), second, first, told);
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
  OthersCommands(const Run& run, const ToldAndDone& told) : run_(run), told_(told) {
    for (const Track& track : run.tracks) deeds_.push_back(deeds_of(track));
    gains_.assign(run.tracks.size(), std::vector<double>(run.tracks.size()));
    for (std::size_t a = 0; a < run.tracks.size(); ++a) look_at(a);
  }
  /// Recomputes the gains of a track after samples were excluded.
  void look_again(std::size_t a) {
    deeds_[a] = deeds_of(run_.tracks[a]);
    look_at(a);
  }
  [[nodiscard]] std::vector<Gain> of(std::size_t a, std::size_t b) const {
    return gains(deeds_[a], run_.tracks[a], run_.tracks[b], told_);
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
      if (b != a) gains_[a][b] = best_stretch(of(a, b)).gain;
  }

  const Run& run_;
  const ToldAndDone& told_;
  std::vector<std::vector<Deed>> deeds_;
  std::vector<std::vector<double>> gains_;  ///< [track][track whose commands are used]
};

/// Numbers exchanged from the start or during a gap, detected by the commands.
void exclude_by_commands(Run& run, const ToldAndDone& told, std::vector<DataFault>& faults) {
  OthersCommands others(run, told);
  while (true) {
    Stretch best;
    std::size_t first = 0, second = 0;
    for (std::size_t a = 0; a < run.tracks.size(); ++a) {
      for (std::size_t b = a + 1; b < run.tracks.size(); ++b) {
        // Both directions must fit: a robot that ignores commands gains by any exchange.
        if (!others.is_like(a, b) || !others.is_like(b, a)) continue;
        std::vector<Gain> both = others.of(a, b);
        const std::vector<Gain> of_b = others.of(b, a);
        both.insert(both.end(), of_b.begin(), of_b.end());
        const Stretch stretch = best_stretch(std::move(both));
        if (stretch.count < kFewestSwapped || stretch.gain < kSwapGainEach * static_cast<double>(stretch.count))
          continue;
        if (stretch.gain <= std::max(best.gain, kSwapGain)) continue;
        best = stretch;
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
  const ToldAndDone told(set);
  if (!told.tells()) return;
  for (Run& run : set.runs) {
    std::vector<Witness> witnesses;
    double begin_s = 1e300, end_s = 0;
    std::size_t deeds = 0, samples = 0;
    for (const Track& track : run.tracks) {
      samples += track.samples.size();
      if (track.commands.size() < 4 || witnesses.size() == kWitnesses) continue;
      witnesses.push_back({&track, deeds_of(track)});
      deeds += witnesses.back().deeds.size();
      if (track.samples.empty()) continue;
      begin_s = std::min(begin_s, track.samples.front().time_s);
      end_s = std::max(end_s, track.samples.back().time_s);
    }
    if (deeds < 100 || end_s < 20) continue;
    const double rate = best_rate(witnesses, told, end_s);
    const double gain = of_rate(witnesses, told, rate, end_s) - of_rate(witnesses, told, 1, end_s);
    if (gain < kClockGain || gain < kClockGainShare * static_cast<double>(deeds) ||
        std::abs(rate - 1) * end_s < kClockShift_s)
      continue;
    faults.push_back(
        {DataFault::Kind::kClock, run.name, std::nullopt, std::nullopt, begin_s, end_s, rate, samples});
    for (Track& track : run.tracks) track.samples.clear();
  }
}

void exclude_swapped(MeasuredSet& set, std::vector<DataFault>& faults) {
  const ToldAndDone told(set);
  for (Run& run : set.runs) {
    exclude_exchanges(run, told, faults);
    if (told.tells()) exclude_by_commands(run, told, faults);
  }
}

}  // namespace kilotwin::identify

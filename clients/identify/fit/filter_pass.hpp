/// Runs a filter along a track: sub-steps between samples and at command changes, one measurement update per
/// sample.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "clients/identify/fit/track_filter.hpp"
#include "clients/identify/model/neighbours.hpp"

namespace kilotwin::identify {

/// Calls each(time_s, h_s, command state at its start) for the sub-steps from `from_s` to `to_s`.
template <class Each> void sub_steps(const CommandClock& clock, double from_s, double to_s, Each&& each) {
  double t = from_s;
  while (t < to_s - 1e-9) {
    const double end = std::min(to_s, clock.next_change_s(t));
    const double length = end - t;
    CommandState state = clock.at(t);
    // A robot at rest needs few sub-steps, once it has come to rest.
    constexpr double kComesToRest_s = 6, kAtRest_s = 2;
    const double longest = state.driven()                   ? kSubStep_s
                           : state.since_s < kComesToRest_s ? 2 * kSubStep_s
                                                            : kAtRest_s;
    const int count = std::max(1, static_cast<int>(std::ceil(length / longest - 1e-9)));
    const double h = length / count;
    for (int i = 0; i < count; ++i) {
      each(t + i * h, h, state);
      state.advance(h);
    }
    t = end;
  }
}

/// A track with what the filter needs. It points to constant objects of the PreparedSet.
struct TrackView {
  const Track* track = nullptr;
  std::uint32_t run = 0;     ///< index in the set
  std::uint32_t number = 0;  ///< run number in effects
  std::size_t place = 0;     ///< index of the track in its run
  const RunNeighbours* neighbours = nullptr;
  const CommandClock* clock = nullptr;
  const std::vector<bool>* at_boundary = nullptr;  ///< whether each sample is at the boundary of visited places
  /// Share of the interval before each sample in a spell of MotionModel::stalls; null: unknown.
  const std::vector<float>* spells = nullptr;
  double start_heading_rad = 0, start_heading_sd_rad = 0;  ///< at the first sample, as last estimated
  std::atomic<std::uint64_t>* work = nullptr;              ///< counts work; null: nobody counts

  /// The part of a situation that does not depend on the pose.
  [[nodiscard]] Situation at(double time_s) const {
    Situation s;
    s.time_s = time_s;
    s.commands = clock->at(time_s);
    s.robot = track->robot;
    s.run = number;
    return s;
  }
};

/// Tells the filter the share of an interval in a spell. Where it is unsure, the interval gives no samples.
inline void tell_spell(TrackFilter& filter, double share, double length_s) {
  // Share nearer to 0 or 1 counts as known; a larger value makes samples of doubtful intervals.
  constexpr double kUnsure = 0.02;
  filter.in_spell(share, share * (1 - share) * length_s, share > kUnsure && share < 1 - kUnsure);
}

/// Runs the filter from the first sample to the last. Calls visitor.start(filter), visitor.step(record) and
/// visitor.update(innovation, sample).
template <class Visitor>
void run_filter(TrackFilter& filter, const TrackView& view, std::size_t samples, Visitor&& visitor) {
  const std::vector<Sample>& all = view.track->samples;
  filter.start(all.front(), {}, view.start_heading_rad, view.start_heading_sd_rad);
  visitor.start(filter);
  std::uint64_t steps = 0;
  for (std::size_t i = 1; i < std::min(samples, all.size()); ++i) {
    filter.at_boundary((*view.at_boundary)[i - 1] || (*view.at_boundary)[i]);
    if (view.spells != nullptr) tell_spell(filter, (*view.spells)[i], all[i].time_s - all[i - 1].time_s);
    sub_steps(*view.clock, all[i - 1].time_s, all[i].time_s, [&](double t, double h, const CommandState& commands) {
      visitor.step(filter.step(t, h, commands, view.neighbours->view(view.place, t + h / 2)));
      ++steps;
    });
    visitor.update(filter.update(all[i], view.clock->at(all[i].time_s - 1e-9)), all[i]);
  }
  if (view.work != nullptr) *view.work += steps;
}

}  // namespace kilotwin::identify

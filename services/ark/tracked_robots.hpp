/// The ingress of tracked robots: which samples belong to which tick, which memberships change, and how long samples take until
/// they act.
#pragma once

#include <chrono>
#include <deque>
#include <vector>

#include "core/federation/run_observer.hpp"
#include "core/federation/service_context.hpp"
#include "services/ark/heard_input.hpp"
#include "services/ark/tracker_input.hpp"
#include "services/ark/tracking/latency_histogram.hpp"
#include "services/ark/tracking/tracked_swarm.hpp"

namespace kilotwin::ark {

class TrackedRobots {
 public:
  using Clock = TrackerInput::Clock;

  TrackedRobots(const RunPlan& plan, const dds::Participant& participant, const ServiceContext& context);

  /// The samples of tick `now`: those that were stamped for it in an earlier attempt at the run, else what has come since the
  /// last call. The observer gets them. `now_cycle`, `pace`: as TrackerInput takes them. Valid until the next call.
  std::span<const TrackerSample> samples_of(Tick now, std::int64_t now_cycle, double pace, RunObserver& observer);
  /// Changes of membership that are due and have not been announced; the caller announces them.
  std::vector<MembershipChange> changes(const TrackedSwarm& swarm);
  /// The poses of tick `now` came at `at`.
  void acted(Tick now, Clock::time_point at);
  void fill(TrackingTotals& totals) const;

 private:
  struct Underway {
    Tick acts;  ///< in the poses of this tick
    Clock::time_point exposed, arrival, published;
  };

  TrackerInput input_;
  HeardInput heard_input_;
  std::deque<std::pair<Tick, TrackerSample>> stamped_;  ///< in an earlier attempt
  std::vector<TrackerSample> samples_;
  std::vector<std::uint8_t>
      announced_;  ///< per robot: 1 + Membership that is announced and has not taken effect; 0: none
  std::deque<Underway> underway_;
  bool counts_ = false;                    ///< latencies: from the second tick on
  LatencyHistogram exposed_;               ///< exposure to effect
  LatencyHistogram effect_, wait_, step_;  ///< arrival to effect, and its parts: to the publication, and from there
  std::uint64_t joined_ = 0, left_ = 0, lost_ = 0, heard_ = 0;
};

}  // namespace kilotwin::ark

/// Samples of camera trackers, from the public topic: checked on receive threads, stamped with simulated time on the station's
/// own thread. The queue is bounded: of a source that floods, the oldest samples are dropped and counted.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/federation/run_observer.hpp"
#include "core/federation/topics.hpp"
#include "core/frames/tracker_sample.hpp"
#include "core/plan/plan.hpp"
#include "services/ark/tracking/clock_model.hpp"
#include "services/ark/tracking/latency_histogram.hpp"

namespace kilotwin::ark {

class TrackerInput {
 public:
  using Clock = std::chrono::steady_clock;

  TrackerInput(const RunPlan& plan, const dds::Participant& participant);

  /// A sample, and what is known of its way here.
  struct Stamped {
    TrackerSample sample;
    Clock::time_point exposed, arrival;  ///< exposed: by the model of the source's clock
  };
  /// Samples that have come since the last call, in the order of arrival. `now_cycle`: the simulated time at `now`; `pace`: simulated
  /// over wall time.
  std::vector<Stamped> take(Clock::time_point now, std::int64_t now_cycle, double pace);

  /// Per source that has sent a sample.
  [[nodiscard]] std::vector<TrackerReport> report() const;

 private:
  struct Source {
    std::string name;
    ClockModel clock;
    LatencyHistogram own, way;  ///< exposure to writing, where the source tells it; writing to arrival
    std::uint64_t frames = 0, dropped = 0, last_frame = 0;
    std::uint32_t restarts = 0;
    bool said_wrong_utc = false;
  };
  struct Waiting {
    std::uint32_t source;
    ClockModel::Sample time;
    TrackerSample sample;
    Clock::time_point arrival;
  };

  void on_sample(const PublicTrackerFrame& sample);
  [[nodiscard]] bool is_repeated(std::size_t source, const PublicTrackerFrame& sample);
  [[nodiscard]] std::ptrdiff_t source_of(const char* name);
  [[nodiscard]] bool copy(const PublicTrackerFrame& from, TrackerSample& to, std::uint32_t first_robot) const;
  void watch(Source& source, const Waiting& waiting);

  const RunPlan& plan_;
  std::mutex mutex_;  // guards the next three
  std::vector<std::string> names_;
  std::deque<Waiting> waiting_;
  std::uint64_t flooded_ = 0, malformed_ = 0;
  std::vector<Source> sources_;  // own thread
  /// Numbers of the frames that came last, per source: what both readers get counts once. With the mutex held.
  std::vector<std::deque<std::pair<std::uint64_t, std::int64_t>>> recent_;
  dds::Reader<PublicTrackerFrame> reader_, repeated_reader_;
};

}  // namespace kilotwin::ark

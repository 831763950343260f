/// Progress and totals of a run: the interface between the federation and the code that records, shows or summarises the run.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/federation/pace.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/radio_counts.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/frames/tracker_sample.hpp"

namespace kilotwin {
namespace proto {
class Observations;
}

/// Progress of a run.
struct RunProgress {
  Tick now;
  double wall_s = 0;                     ///< wall time since the first tick, without pauses
  std::uint64_t sent = 0, received = 0;  ///< messages since the start
  std::uint32_t robots_failed = 0;
  bool paused = false;
  std::string waiting_for;  ///< the federates for which the run waits, one line; empty if it does not wait
};

/// The picture that a virtual environment of the station paints on the floor, for viewers: FloorRecord in idl/recording.proto.
struct FloorPicture {
  std::uint32_t environment = 0;
  std::uint32_t columns = 0, rows = 0;
  std::string rgba;  ///< 4 octets per cell, row by row from the top
  struct Circle {
    double x_mm = 0, y_mm = 0, radius_mm = 0;
    std::array<std::uint8_t, 4> rgba{};
    std::string name;
    bool operator==(const Circle&) const = default;
  };
  std::vector<Circle> circles;
  bool operator==(const FloorPicture&) const = default;
};

/// All functions are called on one thread. The ticks passed to each function ascend.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// The state of the whole swarm at a tick. `last`: the run ends at this tick.
  virtual void state(Tick, const SwarmView&, bool last) = 0;
  /// The chained state hash H(tick).
  virtual void hash(Tick, std::uint64_t chain) = 0;
  /// A directive with its tick and sequence number was announced.
  virtual void input(const Directive&) = 0;
  /// The floor of an environment has changed at this tick.
  virtual void floor(Tick tick, const FloorPicture& floor) {
    static_cast<void>(tick);
    static_cast<void>(floor);
  }
  /// A tracker's sample was stamped for a tick: an input of it. Called in the order in which samples count.
  virtual void tracker_sample(Tick tick, const TrackerSample& sample) {
    static_cast<void>(tick), static_cast<void>(sample);
  }
  /// Observations of hosts, radio, station for the recording: variables and events. Those of a tick come before the state hash of
  /// the next tick but one.
  virtual void observed(const proto::Observations& observations) { static_cast<void>(observations); }
  /// A checkpoint is about to be complete. The recording up to its tick must be on disk when this returns.
  virtual void saved() {}
  /// Called a few times a second, also while the run pauses or waits.
  virtual void idle(const RunProgress& progress) { static_cast<void>(progress); }
};

/// Categories of computing time.
enum class Work : std::uint8_t { kBehaviours, kPhysics, kRadio, kStation, kExchange, kRecording, kCount };

/// Counts of messages and packets that the station sent for its virtual environments.
struct StationTotals {
  std::uint64_t packets = 0, robot_messages = 0, broadcasts = 0;
  std::uint64_t replaced = 0,
                too_wide = 0;  ///< messages that were never sent: replaced by newer ones; too wide for their bits
  double sending_s = 0;        ///< simulated time since the start broadcast
  /// Time that messages waited beyond their robot's least interval.
  double mean_delay_s = 0, p99_delay_s = 0, max_delay_s = 0;
  struct Plugin {
    std::string name, failure;  ///< failure: empty where it is well
  };
  std::vector<Plugin> plugins;
};

/// A tracker as the ingress saw it. Times: s.
struct TrackerReport {
  std::string source;
  std::uint64_t frames = 0;             ///< that arrived
  std::uint64_t dropped = 0;            ///< missing between those that arrived
  std::uint64_t refused = 0;            ///< not used because of their time
  std::uint32_t restarts = 0;           ///< of the source or its clock
  double offset_s = 0;                  ///< station's steady time less source's, at the end
  double drift_ppm = 0;                 ///< how much slower the source's clock runs
  double own_p50_s = 0, own_p99_s = 0;  ///< exposure to writing, where the source states both
  double way_p50_s = 0, way_p99_s = 0;  ///< writing to arrival, beyond the least delay
};

/// Counts of the ingress and the station about tracked robots.
struct TrackingTotals {
  std::vector<TrackerReport> trackers;
  /// From the arrival of a sample to the arrival of the poses on which it acted, s.
  double effect_p50_s = 0, effect_p99_s = 0;
  /// The same from the middle of the sample's exposure, s.
  double exposed_p50_s = 0, exposed_p99_s = 0;
  std::uint64_t joined = 0, left = 0, lost = 0;
  std::uint64_t jumps = 0;                 ///< estimates restarted because samples contradicted them
  double wait_p50_s = 0, wait_p99_s = 0;   ///< arrival to the publication of the frame that it joins
  double step_p50_s = 0, step_p99_s = 0;   ///< that publication to the poses that follow from it
  std::uint64_t heard = 0;                 ///< messages of real robots that listeners heard
  std::uint64_t bodies_without_space = 0;  ///< how often a tracked robot came to stand on another body
};

/// Where the wall time of a federate went, from its first tick to its last.
struct FederateTime {
  std::string name;       ///< RunPlan::name()
  double step_s = 0;      ///< in its engine
  double exchange_s = 0;  ///< publishing its frames
  double wait_s = 0;      ///< for other federates, and for the run's pace
};

/// Totals of a run.
struct RunTotals {
  Tick first, last;  ///< last: the tick at which the run ended, possibly before the experiment's end
  std::uint64_t state_hash = 0;
  double wall_s = 0;           ///< wall time from the first to the last tick, without pauses
  double cpu_s = 0;            ///< CPU time of all processes
  double peak_memory_mib = 0;  ///< sum over all processes
  std::uint64_t attempted = 0, sent = 0, received = 0, collided = 0;
  std::uint32_t robots_failed = 0;
  std::array<std::uint64_t, static_cast<std::size_t>(Work::kCount)> work_ns{};
  std::vector<FederateTime> federates;  ///< in the order of the plan; empty if all engines share a process
  StationTotals station;                ///< empty without virtual environments
  std::vector<PairCount> pairs;         ///< empty unless RecordingSettings::messages
  std::vector<RadioCount> radios;       ///< per robot; empty if the run failed before the radio's report
  bool stopped_early = false;           ///< a directive ended the run
  LatenessTotals lateness;              ///< where the run was paced
  TrackingTotals tracking;              ///< where robots are tracked
  std::string failure;                  ///< one line if the run failed, else empty
};

}  // namespace kilotwin

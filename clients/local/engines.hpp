/// All engines of a run in this process, and the frames that they exchange. Their owner decides when they step.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/federation/checkpoint.hpp"
#include "core/federation/run_observer.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/frames/tracker_sample.hpp"
#include "services/ark/station_engine.hpp"
#include "services/behaviours/engine.hpp"
#include "services/behaviours/program_set.hpp"
#include "services/comm/radio_engine.hpp"
#include "services/physics/engine.hpp"

namespace kilotwin::os {
class WorkerPool;
}

namespace kilotwin::local {

class Engines {
 public:
  struct Options {
    std::filesystem::path run_directory;  ///< holds the programs
    Tick first{0};                        ///< at which the run begins; if it is not 0, load() comes next
    std::uint32_t firmware_threads = 1;
    bool keeps_firmware_logs = false;
  };
  /// Called once a host has stepped from a tick, on the thread of that step.
  using HostStepped = std::function<void(std::uint32_t host, Tick from)>;

  Engines(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs, const Options& options);
  Engines(const Engines&) = delete;

  void load(const Checkpoint& checkpoint);
  /// The part of a checkpoint that federate `task` adds: partitions, radio, station, hosts.
  void save(std::uint32_t task, proto::CheckpointPart& part) const;

  /// Makes the frames of the first tick. `samples`: of trackers, stamped for it.
  void begin(std::span<const TrackerSample> samples = {});
  /// Steps from tick `from` to the next, whose samples of trackers are `samples`. `schedule` has said kStep at `from`.
  void step(os::WorkerPool& workers, Tick from, const RunSchedule& schedule,
            std::span<const TrackerSample> samples = {}, const HostStepped& stepped = {});

  /// The swarm at the tick that begin() or step() reached.
  [[nodiscard]] const SwarmView& swarm() const { return swarm_; }
  /// The share of the state hash of that tick: the sum over all entities.
  [[nodiscard]] std::uint64_t hash_sum() const;
  /// The station's frame of that tick.
  [[nodiscard]] const OverheadFrame& overhead() const { return frames_of(swarm_.tick).overhead; }

  [[nodiscard]] comm::RadioEngine& radio() { return radio_; }
  [[nodiscard]] const comm::RadioEngine& radio() const { return radio_; }
  [[nodiscard]] ark::StationEngine& station() { return station_; }
  [[nodiscard]] const ark::StationEngine& station() const { return station_; }
  [[nodiscard]] const std::vector<std::unique_ptr<behaviours::BehavioursEngine>>& hosts() const { return hosts_; }
  [[nodiscard]] std::uint32_t robots_failed() const;
  /// How often a tracked robot came to stand on another body.
  [[nodiscard]] std::uint64_t bodies_without_space() const;
  /// Adds the computing time so far.
  void add_work(RunTotals& totals) const;

 private:
  /// All frames of one tick.
  struct Frames {
    std::vector<BodyFrame> bodies;               // per partition
    std::vector<std::vector<BodyFrame>> ghosts;  // per sending partition and its neighbours
    std::vector<RadioFrame> radio;               // per host
    std::vector<ActuationFrame> actuation;       // per host
    OverheadFrame overhead;
    TrackingFrame tracking;
    // Views of the frames above, in the form that engines take.
    std::vector<const BodyFrame*> all_bodies;
    std::vector<const ActuationFrame*> all_actuation;
    std::vector<std::vector<const BodyFrame*>> ghosts_for;  // per receiving partition, by ascending sender
  };

  void connect(Frames& frames) const;
  void step(std::uint32_t task, Tick from, const RunSchedule& schedule, const HostStepped& stepped);
  void emit(std::uint32_t task, Frames& out, std::span<const TrackerSample> samples);
  void gather(Tick now);
  [[nodiscard]] const Frames& frames_of(Tick tick) const {
    return frames_[static_cast<std::size_t>(tick.count() & 1)];
  }
  [[nodiscard]] Frames& frames_of(Tick tick) { return frames_[static_cast<std::size_t>(tick.count() & 1)]; }

  const RunPlan& plan_;
  const Tick first_;
  std::vector<std::unique_ptr<physics::Engine>> physics_;
  comm::RadioEngine radio_;
  ark::StationEngine station_;
  SwarmView swarm_;
  std::vector<std::unique_ptr<behaviours::BehavioursEngine>> hosts_;
  Frames frames_[2];  // double buffer, indexed by the tick's parity: a step reads one and writes the other
  std::vector<std::uint64_t> task_ns_, hash_parts_;
};

}  // namespace kilotwin::local

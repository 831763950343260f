#include "clients/local/local_run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/base/state_hash.hpp"
#include "core/federation/hash_sums.hpp"
#include "core/federation/pace.hpp"
#include "core/federation/snapshots.hpp"
#include "core/logs/robot_logs.hpp"
#include "core/observations/events.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/worker_pool.hpp"
#include "idl/recording.pb.h"
#include "services/ark/station_engine.hpp"
#include "services/ark/station_outputs.hpp"
#include "services/behaviours/eeprom_files.hpp"
#include "services/behaviours/engine.hpp"
#include "services/behaviours/host_observer.hpp"
#include "services/behaviours/running_note.hpp"
#include "services/behaviours/watchdog.hpp"
#include "services/comm/firmware/firmware_swarm.hpp"
#include "services/comm/radio_engine.hpp"
#include "services/comm/radio_observer.hpp"
#include "services/physics/engine.hpp"

namespace kilotwin::local {
namespace {

using Clock = std::chrono::steady_clock;

/// Period of calls to the observer's idle().
constexpr auto kIdlePeriod = std::chrono::milliseconds(100);

/// Number of failed robots per host that are printed one by one.
constexpr std::size_t kFailuresPrinted = 20;

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

class LocalRun {
 public:
  LocalRun(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
           const LocalOptions& options, RunObserver& observer)
      : plan_(plan),
        options_(options),
        observer_(observer),
        radio_(plan, firmware::make_firmware_robots(plan, options.run_directory, options.threads,
                                                    options.resumed ? options.resumed->tick : Tick{0},
                                                    options.save_checkpoints)),
        station_(plan, options.run_directory),
        station_outputs_(plan, options.save_checkpoints ? options.run_directory : std::filesystem::path{},
                         options.resumed ? options.resumed->tick : Tick{0}),
        swarm_(plan.robots(), plan.movables(), plan.memory.size()),
        radio_observer_(plan, radio_),
        records_packets_(RecordedEvents(plan).station),
        first_(options.resumed ? options.resumed->tick : Tick{0}),
        schedule_(first_, plan.last_tick, plan.checkpoint_every()),
        snapshots_(options.run_directory,
                   options.save_checkpoints && !options.run_directory.empty() && plan.checkpoint_every() == 0) {
    for (std::uint32_t p = 0; p < plan.grid.size(); ++p)
      physics_.push_back(physics::make_engine(plan, PartitionId{p}));
    for (std::uint32_t h = 0; h < plan.hosts; ++h) {
      hosts_.push_back(std::make_unique<behaviours::BehavioursEngine>(plan, HostId{h}, programs));
      if (options.run_directory.empty() || !options.save_checkpoints) continue;
      logs_.push_back(std::make_unique<RobotLogs>(options.run_directory, plan.tick_length, first_,
                                                  [&plan, share = plan.share(HostId{h})](std::uint32_t robot) {
                                                    return share.contains(robot) && !plan.firmware(robot);
                                                  }));
      notes_.push_back(std::make_unique<behaviours::RunningNote>(options.run_directory, HostId{h}));
      hosts_.back()->note_running_in(notes_.back()->place());
    }
    if (options.resumed) load(*options.resumed);
    for (std::uint32_t h = 0; h < plan.hosts; ++h) host_observers_.emplace_back(plan, HostId{h}, *hosts_[h]);
    for (const Directive& directive : options.inputs) schedule_.add(directive);
    for (Frames& frames : frames_) connect(frames);
    task_ns_.resize(plan.federates());
    hash_parts_.resize(plan.federates());
    for (const auto& engine : hosts_) printed_.emplace_back(engine->failures().size(), engine->warnings().size());
  }

  RunTotals run() {
    take_tracker_samples(first_);
    std::uint64_t chain = options_.resumed ? options_.resumed->hash_chain() : 0;
    for (std::uint32_t task = 0; task < plan_.federates(); ++task) emit(task, frames_of(first_));
    if (first_hashed(first_) == first_) chain = close_tick(first_, chain);

    std::vector<const behaviours::BehavioursEngine*> engines;
    for (const auto& engine : hosts_) engines.push_back(engine.get());
    const behaviours::Watchdog watchdog(engines);
    os::WorkerPool workers(options_.threads);
    const auto begun = Clock::now();
    auto next_idle = begun;
    Tick now = first_;
    RunTotals totals;
    const Pace pace(plan_);
    Lateness lateness(plan_);
    for (;; ++now) {
      const auto wall_s = [begun] { return static_cast<double>(ns(begun, Clock::now())) * 1e-9; };
      pace.hold(now - first_, wall_s, [&] { observer_.idle(progress(now, wall_s())); });
      if (now > first_ && totals.failure.empty()) {
        try {
          lateness.tick_begins(now, pace.ahead_s(now - first_, wall_s()));
        } catch (const RunError& error) {
          totals.failure = error.what();
        }
      }
      const bool finished = schedule_.verdict(now) == RunSchedule::Verdict::kFinished;
      if (!finished && interrupted() != 0 && totals.failure.empty()) totals.failure = "interrupted";
      const bool last = finished || !totals.failure.empty();
      if (options_.save_checkpoints && schedule_.checkpoint_at(now)) save(now, chain);
      const auto recorded_from = Clock::now();
      swarm_.gather(now, frames_of(now).all_bodies);
      swarm_.gather(frames_of(now).all_actuation);
      observe(now);
      observer_.state(now, swarm_, last);
      const auto recorded_to = Clock::now();
      recording_ns_ += ns(recorded_from, recorded_to);
      if (!last && snapshots_.due(recorded_to)) {
        save(now, chain);
        snapshots_.taken(now);
      }
      if (recorded_to >= next_idle) {
        next_idle = recorded_to + kIdlePeriod;
        observer_.idle(progress(now, static_cast<double>(ns(begun, recorded_to)) * 1e-9));
      }
      if (last) break;
      step(workers, now);
      print_faults(now);
      chain = close_tick(now + 1, chain);
      try {
        station_outputs_.take(now, station_, observer_);
      } catch (const RunError& error) {
        totals.failure = error.what();
      }
    }
    totals.wall_s = static_cast<double>(ns(begun, Clock::now())) * 1e-9;
    totals.first = first_;
    totals.last = now;
    totals.state_hash = chain;
    totals.stopped_early = schedule_.stopped_early();
    totals.lateness = lateness.totals();
    if (totals.failure.empty()) snapshots_.remove_all();
    if (!options_.run_directory.empty()) {
      for (std::uint32_t h = 0; h < plan_.hosts; ++h)
        behaviours::write_eeproms(*hosts_[h], plan_.share(HostId{h}), options_.run_directory);
    }
    fill(totals);
    totals.station = ark::station_totals(plan_, station_, now);
    return totals;
  }

 private:
  /// Steps all engines from `from` to the next tick. A task steps one engine. Hosts start first because they take longest.
  void step(os::WorkerPool& workers, Tick from) {
    take_tracker_samples(from + 1);
    const std::uint32_t tasks = plan_.federates();
    workers.for_each(tasks, [this, from, tasks](std::size_t i) {
      const auto task = tasks - 1 - static_cast<std::uint32_t>(i);
      const auto begun = Clock::now();
      step(task, from);
      emit(task, frames_of(from + 1));
      task_ns_[task] += ns(begun, Clock::now());
    });
  }

  /// What hosts, radio and station observed: in the step to `now`, and at it.
  void observe(Tick now) {
    for (behaviours::HostObserver& host : host_observers_) {
      if (now > first_) host.stepped(now - 1, observed_);
      host.at(now, observed_);
    }
    if (now > first_) radio_observer_.stepped(now - 1, observed_);
    radio_observer_.at(now, observed_);
    if (records_packets_) note_packets(frames_of(now).overhead, observed_);
    if (observed_.variable_size() == 0 && observed_.event_size() == 0) return;
    observer_.observed(observed_);
    observed_.Clear();
  }

  void take_tracker_samples(Tick tick) {
    tracker_samples_.clear();
    if (!options_.tracker_samples) return;
    tracker_samples_ = options_.tracker_samples(tick);
    for (const TrackerSample& sample : tracker_samples_) observer_.tracker_sample(tick, sample);
  }

  static std::uint64_t ns(Clock::time_point from, Clock::time_point to) {
    return static_cast<std::uint64_t>(std::chrono::nanoseconds(to - from).count());
  }

  Frames& frames_of(Tick tick) { return frames_[static_cast<std::size_t>(tick.count() & 1)]; }

  void connect(Frames& frames) {
    const std::size_t partitions = physics_.size();
    frames.bodies.resize(partitions);
    frames.ghosts.resize(partitions);
    frames.ghosts_for.resize(partitions);
    frames.radio.resize(hosts_.size());
    frames.actuation.resize(hosts_.size());
    for (std::size_t p = 0; p < partitions; ++p) {
      frames.all_bodies.push_back(&frames.bodies[p]);
      frames.ghosts[p].resize(physics_[p]->neighbours().size());
    }
    for (std::size_t p = 0; p < partitions; ++p) {
      for (std::size_t i = 0; i < frames.ghosts[p].size(); ++i) {
        frames.ghosts_for[physics_[p]->neighbours()[i].value()].push_back(&frames.ghosts[p][i]);
      }
    }
    for (const ActuationFrame& frame : frames.actuation) frames.all_actuation.push_back(&frame);
  }

  // Tasks have the numbers of federates: partitions, radio, station, hosts.
  void step(std::uint32_t task, Tick from) {
    const Frames& in = frames_of(from);
    const auto partitions = static_cast<std::uint32_t>(physics_.size());
    if (task < partitions) {
      physics_[task]->step(from, {in.ghosts_for[task], in.all_actuation,
                                  plan_.any_tracked() ? &in.tracking : nullptr, schedule_.memberships()});
    } else if (task == partitions) {
      radio_.step(from, {swarm_, in.overhead});
    } else if (task == partitions + 1) {
      station_.step(from, {swarm_, schedule_.overhead_inputs(), schedule_.memberships()});
    } else {
      const std::size_t host = task - partitions - 2;
      hosts_[host]->step(from, in.radio[host], &swarm_,
                         {plan_.any_tracked() ? &in.tracking : nullptr, schedule_.memberships()});
      if (logs_.empty()) return;
      for (const auto& printed : hosts_[host]->printed()) logs_[host]->write(from, printed.robot, printed.text);
    }
  }

  void emit(std::uint32_t task, Frames& out) {
    const auto partitions = static_cast<std::uint32_t>(physics_.size());
    if (task < partitions) {
      physics_[task]->emit_bodies(out.bodies[task]);
      for (std::size_t i = 0; i < out.ghosts[task].size(); ++i) {
        physics_[task]->emit_ghosts(physics_[task]->neighbours()[i], out.ghosts[task][i]);
      }
      hash_parts_[task] = physics_[task]->hash_part();
    } else if (task == partitions) {
      for (std::uint32_t h = 0; h < hosts_.size(); ++h) radio_.emit(HostId{h}, out.radio[h]);
      hash_parts_[task] = radio_.hash_part();
    } else if (task == partitions + 1) {
      station_.emit(out.overhead);
      if (plan_.any_tracked()) {
        station_.take(tracker_samples_);
        station_.emit(out.tracking);
      }
      hash_parts_[task] = station_.hash_part();
    } else {
      hosts_[task - partitions - 2]->emit(out.actuation[task - partitions - 2]);
      hash_parts_[task] = hosts_[task - partitions - 2]->hash_part();
    }
  }

  /// Prints failures and warnings of programs in the step from tick `from`.
  void print_faults(Tick from) {
    for (std::size_t h = 0; h < hosts_.size(); ++h) {
      const double at_s = plan_.tick_length.seconds_at(from);
      auto& [failures, warnings] = printed_[h];
      for (; failures < hosts_[h]->failures().size(); ++failures) {
        const auto& failure = hosts_[h]->failures()[failures];
        if (failures < kFailuresPrinted)
          say(fmt::format("robot {} failed at {:.3f} s: {}", failure.robot, at_s, failure.text));
        else if (failures == kFailuresPrinted)
          say("more robots fail; the summary counts them");
      }
      for (; warnings < hosts_[h]->warnings().size(); ++warnings) {
        const auto& warning = hosts_[h]->warnings()[warnings];
        say(fmt::format("robot {} at {:.3f} s: {}", warning.robot, at_s, warning.text));
      }
    }
  }

  std::uint64_t close_tick(Tick tick, std::uint64_t chain) {
    std::uint64_t sum = 0;
    for (const std::uint64_t part : hash_parts_) sum += part;
    chain = hash_chain(chain, sum);
    observer_.hash(tick, chain);
    return chain;
  }

  void save(Tick now, std::uint64_t chain) {
    observer_.saved();
    // A run that resumes from this checkpoint keeps the lines printed before it, so the files must hold them.
    for (const auto& logs : logs_) logs->flush();
    for (std::uint32_t task = 0; task < plan_.federates(); ++task) {
      proto::CheckpointPart part;
      if (task < physics_.size())
        physics_[task]->save(*part.mutable_physics());
      else if (task == physics_.size())
        radio_.save(*part.mutable_radio());
      else if (task == physics_.size() + 1)
        station_.save(*part.mutable_station());
      else
        hosts_[task - physics_.size() - 2]->save(*part.mutable_behaviours());
      if (part.has_station()) part.mutable_station()->set_hash_chain(chain);
      write_checkpoint_part(options_.run_directory, plan_, now, FederateId{task}, part);
    }
  }

  void load(const Checkpoint& checkpoint) {
    for (const auto& engine : physics_) engine->load(checkpoint.tick, checkpoint.physics());
    radio_.load(checkpoint.tick, checkpoint.radio());
    station_.load(checkpoint.tick, checkpoint.station());
    for (const auto& engine : hosts_) engine->load(checkpoint.tick, checkpoint.behaviours());
  }

  [[nodiscard]] RunProgress progress(Tick now, double wall_s) const {
    RunProgress progress;
    progress.now = now;
    progress.wall_s = wall_s;
    progress.sent = radio_.counters().sent;
    progress.received = radio_.counters().received;
    for (const auto& engine : hosts_) progress.robots_failed += engine->robots_failed();
    return progress;
  }

  void fill(RunTotals& totals) const {
    const auto add = [&](Work work, std::uint64_t value) {
      totals.work_ns[static_cast<std::size_t>(work)] += value;
    };
    for (std::uint32_t task = 0; task < task_ns_.size(); ++task) {
      add(task < physics_.size()        ? Work::kPhysics
          : task == physics_.size()     ? Work::kRadio
          : task == physics_.size() + 1 ? Work::kStation
                                        : Work::kBehaviours,
          task_ns_[task]);
    }
    add(Work::kRecording, recording_ns_);
    const auto& counters = radio_.counters();
    totals.attempted = counters.attempted;
    totals.sent = counters.sent;
    totals.received = counters.received;
    totals.collided = counters.collided;
    totals.pairs = radio_.pair_counts();
    totals.radios = radio_.radio_counts();
    for (const auto& engine : hosts_) totals.robots_failed += engine->robots_failed();
    for (const auto& engine : physics_) totals.tracking.bodies_without_space += engine->bodies_without_space();
    totals.tracking.jumps = station_.tracked().jumps();
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
    };
    totals.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    totals.peak_memory_mib = static_cast<double>(usage.ru_maxrss) / 1024.0;
  }

  const RunPlan& plan_;
  const LocalOptions& options_;
  RunObserver& observer_;
  std::vector<std::unique_ptr<physics::Engine>> physics_;
  comm::RadioEngine radio_;
  ark::StationEngine station_;
  ark::StationOutputs station_outputs_;
  SwarmView swarm_;  // at the current tick
  std::vector<std::unique_ptr<behaviours::BehavioursEngine>> hosts_;
  // One per host; empty without a run directory.
  std::vector<std::unique_ptr<RobotLogs>> logs_;
  std::vector<std::unique_ptr<behaviours::RunningNote>> notes_;
  std::vector<behaviours::HostObserver> host_observers_;
  comm::RadioObserver radio_observer_;
  const bool records_packets_;
  proto::Observations observed_;  // not yet handed on
  const Tick first_;
  RunSchedule schedule_;
  Snapshots snapshots_;
  std::vector<TrackerSample> tracker_samples_;  // of the tick whose frames are to be made
  Frames frames_[2];  // double buffer, indexed by the tick's parity: a step reads one and writes the other
  std::vector<std::uint64_t> task_ns_, hash_parts_;
  std::vector<std::pair<std::size_t, std::size_t>> printed_;  // per host: number of printed failures and warnings
  std::uint64_t recording_ns_ = 0;
};

}  // namespace

RunTotals run(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
              const LocalOptions& options, RunObserver& observer) {
  return LocalRun(plan, programs, options, observer).run();
}

}  // namespace kilotwin::local

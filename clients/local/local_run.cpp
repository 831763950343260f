#include "clients/local/local_run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <utility>

#include "clients/local/engines.hpp"
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
#include "services/ark/station_outputs.hpp"
#include "services/behaviours/eeprom_files.hpp"
#include "services/behaviours/host_observer.hpp"
#include "services/behaviours/running_note.hpp"
#include "services/behaviours/watchdog.hpp"
#include "services/comm/radio_observer.hpp"

namespace kilotwin::local {
namespace {

using Clock = std::chrono::steady_clock;

/// Period of calls to the observer's idle().
constexpr auto kIdlePeriod = std::chrono::milliseconds(100);

/// Number of failed robots per host that are printed one by one.
constexpr std::size_t kFailuresPrinted = 20;

class LocalRun {
 public:
  LocalRun(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
           const LocalOptions& options, RunObserver& observer)
      : plan_(plan),
        options_(options),
        observer_(observer),
        engines_(plan, programs,
                 {options.run_directory, options.resumed ? options.resumed->tick : Tick{0}, options.threads,
                  options.save_checkpoints}),
        station_outputs_(plan, options.save_checkpoints ? options.run_directory : std::filesystem::path{},
                         options.resumed ? options.resumed->tick : Tick{0}),
        radio_observer_(plan, engines_.radio()),
        records_packets_(RecordedEvents(plan).station),
        first_(options.resumed ? options.resumed->tick : Tick{0}),
        schedule_(first_, plan.last_tick, plan.checkpoint_every()),
        snapshots_(options.run_directory,
                   options.save_checkpoints && !options.run_directory.empty() && plan.checkpoint_every() == 0) {
    for (std::uint32_t h = 0; h < plan.hosts; ++h) {
      if (options.run_directory.empty() || !options.save_checkpoints) continue;
      logs_.push_back(std::make_unique<RobotLogs>(options.run_directory, plan.tick_length, first_,
                                                  [&plan, share = plan.share(HostId{h})](std::uint32_t robot) {
                                                    return share.contains(robot) && !plan.firmware(robot);
                                                  }));
      notes_.push_back(std::make_unique<behaviours::RunningNote>(options.run_directory, HostId{h}));
      engines_.hosts()[h]->note_running_in(notes_.back()->place());
    }
    if (options.resumed) engines_.load(*options.resumed);
    for (std::uint32_t h = 0; h < plan.hosts; ++h)
      host_observers_.emplace_back(plan, HostId{h}, *engines_.hosts()[h]);
    for (const Directive& directive : options.inputs) schedule_.add(directive);
    for (const auto& engine : engines_.hosts())
      printed_.emplace_back(engine->failures().size(), engine->warnings().size());
  }

  RunTotals run() {
    take_tracker_samples(first_);
    std::uint64_t chain = options_.resumed ? options_.resumed->hash_chain() : 0;
    engines_.begin(tracker_samples_);
    if (first_hashed(first_) == first_) chain = close_tick(first_, chain);

    std::vector<const behaviours::BehavioursEngine*> engines;
    for (const auto& engine : engines_.hosts()) engines.push_back(engine.get());
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
      observe(now);
      observer_.state(now, engines_.swarm(), last);
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
        station_outputs_.take(now, engines_.station(), observer_);
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
    try {
      flush_logs();
    } catch (const RunError& error) {
      if (totals.failure.empty()) totals.failure = error.what();
    }
    if (totals.failure.empty()) snapshots_.remove_all();
    if (!options_.run_directory.empty()) {
      for (std::uint32_t h = 0; h < plan_.hosts; ++h)
        behaviours::write_eeproms(*engines_.hosts()[h], plan_.share(HostId{h}), options_.run_directory);
    }
    fill(totals);
    totals.station = ark::station_totals(plan_, engines_.station(), now);
    return totals;
  }

 private:
  void step(os::WorkerPool& workers, Tick from) {
    take_tracker_samples(from + 1);
    engines_.step(workers, from, schedule_, tracker_samples_, [this](std::uint32_t host, Tick tick) {
      if (logs_.empty()) return;
      for (const auto& printed : engines_.hosts()[host]->printed())
        logs_[host]->write(tick, printed.robot, printed.text);
    });
  }

  /// Hands on the observations of hosts, radio and station: those in the step to `now`, and those at it.
  void observe(Tick now) {
    for (behaviours::HostObserver& host : host_observers_) {
      if (now > first_) host.stepped(now - 1, observed_);
      host.at(now, observed_);
    }
    if (now > first_) radio_observer_.stepped(now - 1, observed_);
    radio_observer_.at(now, observed_);
    if (records_packets_) note_packets(engines_.overhead(), observed_);
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

  void flush_logs() {
    for (const auto& logs : logs_) logs->flush();
    if (engines_.radio().firmware() != nullptr) engines_.radio().firmware()->flush_logs();
  }

  static std::uint64_t ns(Clock::time_point from, Clock::time_point to) {
    return static_cast<std::uint64_t>(std::chrono::nanoseconds(to - from).count());
  }

  /// Prints failures and warnings of programs in the step from tick `from`.
  void print_faults(Tick from) {
    for (std::size_t h = 0; h < engines_.hosts().size(); ++h) {
      const double at_s = plan_.tick_length.seconds_at(from);
      auto& [failures, warnings] = printed_[h];
      const behaviours::BehavioursEngine& host = *engines_.hosts()[h];
      for (; failures < host.failures().size(); ++failures) {
        const auto& failure = host.failures()[failures];
        if (failures < kFailuresPrinted)
          say(fmt::format("robot {} failed at {:.3f} s: {}", failure.robot, at_s, failure.text));
        else if (failures == kFailuresPrinted)
          say("more robots fail; the summary counts them");
      }
      for (; warnings < host.warnings().size(); ++warnings) {
        const auto& warning = host.warnings()[warnings];
        say(fmt::format("robot {} at {:.3f} s: {}", warning.robot, at_s, warning.text));
      }
    }
  }

  std::uint64_t close_tick(Tick tick, std::uint64_t chain) {
    chain = hash_chain(chain, engines_.hash_sum());
    observer_.hash(tick, chain);
    return chain;
  }

  void save(Tick now, std::uint64_t chain) {
    observer_.saved();
    // A run that resumes from this checkpoint keeps the lines printed before it, so the files must hold them.
    flush_logs();
    for (std::uint32_t task = 0; task < plan_.federates(); ++task) {
      proto::CheckpointPart part;
      engines_.save(task, part);
      if (part.has_station()) part.mutable_station()->set_hash_chain(chain);
      write_checkpoint_part(options_.run_directory, plan_, now, FederateId{task}, part);
    }
  }

  [[nodiscard]] RunProgress progress(Tick now, double wall_s) const {
    RunProgress progress;
    progress.now = now;
    progress.wall_s = wall_s;
    progress.sent = engines_.radio().counters().sent;
    progress.received = engines_.radio().counters().received;
    progress.robots_failed = engines_.robots_failed();
    return progress;
  }

  void fill(RunTotals& totals) const {
    engines_.add_work(totals);
    totals.work_ns[static_cast<std::size_t>(Work::kRecording)] += recording_ns_;
    const auto& counters = engines_.radio().counters();
    totals.attempted = counters.attempted;
    totals.sent = counters.sent;
    totals.received = counters.received;
    totals.collided = counters.collided;
    totals.pairs = engines_.radio().pair_counts();
    totals.radios = engines_.radio().radio_counts();
    totals.robots_failed = engines_.robots_failed();
    totals.tracking.bodies_without_space = engines_.bodies_without_space();
    totals.tracking.jumps = engines_.station().tracked().jumps();
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
  Engines engines_;
  ark::StationOutputs station_outputs_;
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
  std::vector<TrackerSample> tracker_samples_;                // of the tick whose frames are to be made
  std::vector<std::pair<std::size_t, std::size_t>> printed_;  // per host: number of printed failures and warnings
  std::uint64_t recording_ns_ = 0;
};

}  // namespace

RunTotals run(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
              const LocalOptions& options, RunObserver& observer) {
  return LocalRun(plan, programs, options, observer).run();
}

}  // namespace kilotwin::local

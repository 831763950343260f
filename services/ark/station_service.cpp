#include "services/ark/station_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <thread>

#include "core/base/error.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/pace.hpp"
#include "core/federation/snapshots.hpp"
#include "core/observations/events.hpp"
#include "core/os/interrupt.hpp"
#include "idl/recording.pb.h"
#include "services/ark/external_input.hpp"
#include "services/ark/run_metrics.hpp"
#include "services/ark/station_engine.hpp"
#include "services/ark/station_outputs.hpp"
#include "services/ark/swarm_stream.hpp"
#include "services/ark/tracked_robots.hpp"

namespace kilotwin::ark {
namespace {

using Clock = std::chrono::steady_clock;

/// For how long the station waits for the other federates' last metrics, s.
constexpr double kMetricsPatience_s = 5.0;
/// How often the status tells of a plugin that computes, wall time.
constexpr auto kStatusPeriod = std::chrono::milliseconds(200);
/// How often observers get robots' states, wall time.
constexpr auto kRobotsPeriod = std::chrono::milliseconds(100);

class StationFederate : public Federate {
 public:
  StationFederate(Session& session, StationEngine& engine, RunMetrics& metrics, RunObserver& observer,
                  const ServiceContext& context)
      : session_(session),
        context_(context),
        engine_(engine),
        metrics_(metrics),
        observer_(observer),
        ingress_(context.inputs),
        snapshots_(context.run_directory, session.plan().checkpoint_every() == 0),
        external_input_(session.plan(), session.participant()),
        bodies_(session, topics::bodies(), session.plan().all_physics()),
        actuation_(session, topics::actuation(), session.plan().all_behaviours()),
        overhead_(session, topics::overhead()),
        status_(session.participant(), topics::run_status()),
        robots_(session.participant(), topics::robots()),
        station_packets_(session.participant(), topics::station_packets()),
        swarm_stream_(session.plan(), session.participant()) {
    engine_.while_plugins_compute([this](const std::string& plugin) { tell_of(plugin); });
    if (!session.plan().any_tracked()) return;
    tracked_.emplace(session.plan(), session.participant(), context);
    tracking_.emplace(session, topics::tracking());
  }

  void publish(Tick now) override {
    if (now > session_.first()) lateness_.tick_begins(now, ahead_s(now));
    announce(now);
    if (tracked_) {
      follow_tracked(now);
      engine_.emit(tracking_->frame);
      tracking_->write();
    }
    engine_.emit(overhead_.frame);
    overhead_.write();
    if (records_packets_) {
      proto::Observations observed;
      note_packets(overhead_.frame, observed);
      if (observed.event_size() > 0) observer_.observed(observed);
    }
    if (!overhead_.frame.packets.empty() && station_packets_.readers() > 0) publish_packets(now);
  }

  [[nodiscard]] bool hears_all() override { return metrics_.heard_all(); }
  [[nodiscard]] double ahead_s(Tick now) override {
    return pace_.ahead_s(now - session_.first(), session_.wall_s());
  }

  void inputs_complete(Tick now, bool last) override {
    swarm_.gather(now, bodies_.at(now));
    swarm_.gather(actuation_.at(now));
    if (tracked_) tracked_->acted(now, bodies_.arrived(now));
    const auto begun = Clock::now();
    observer_.state(now, swarm_, last);
    recording_ns_ += static_cast<std::uint64_t>(std::chrono::nanoseconds(Clock::now() - begun).count());
    if (begun >= next_robots_ && robots_.readers() > 0) publish_robots(now);
    if (begun >= next_robots_) next_robots_ = begun + kRobotsPeriod;
    swarm_stream_.offer(swarm_, last);
  }

  void step(Tick from) override {
    engine_.step(from, {swarm_, session_.schedule().overhead_inputs(), session_.schedule().memberships()});
    outputs_.take(from, engine_, observer_);
  }

  [[nodiscard]] std::uint64_t hash_part() const override { return engine_.hash_part(); }

  void save(Tick now) override {
    proto::CheckpointPart part;
    engine_.save(*part.mutable_station());
    unfinished_.emplace_back(now, std::move(part));
    settle();
  }

  void idle() override {
    announce(session_.now());
    settle();
    await_parts();
    const RunProgress progress = this->progress();
    observer_.idle(progress);
    if (progress.paused) {
      // All frames of this tick are there; only the step that takes them waits.
      const Tick now = session_.now();
      swarm_.gather(now, bodies_.at(now));
      swarm_.gather(actuation_.at(now));
      swarm_stream_.repeat(swarm_);
    }
    publish_status(!session_.started() ? kilotwin_open_STARTING
                   : progress.paused   ? kilotwin_open_PAUSED
                                       : kilotwin_open_RUNNING,
                   progress);
  }

  /// Takes in what federates have counted, and writes checkpoint parts whose state hash has become known.
  void settle() {
    write_checkpoint();
    metrics_.advance(observer_, [this](Tick tick, std::uint64_t chain) {
      observer_.hash(tick, chain);
      write_checkpoint();
    });
  }

  [[nodiscard]] RunProgress progress() {
    RunTotals totals;
    metrics_.fill(totals);
    return {session_.now(),       session_.wall_s(), totals.sent,           totals.received,
            totals.robots_failed, session_.paused(), session_.waiting_for()};
  }

  void publish_status(kilotwin_open_RunPhase phase, const RunProgress& progress) {
    const RunPlan& plan = session_.plan();
    PublicRunStatus status{};
    status.run = plan.run();
    plan.experiment_name().copy(status.name, sizeof status.name - 1);
    status.phase = phase;
    status.tick = progress.now.count();
    status.last_tick = plan.last_tick.count();
    status.simulated_s = plan.tick_length.seconds_at(progress.now);
    status.wall_s = progress.wall_s;
    status.robots = plan.robots();
    status.robots_failed = progress.robots_failed;
    status.sent = progress.sent;
    status.received = progress.received;
    progress.waiting_for.copy(status.note, sizeof status.note - 1);
    status.saved_tick = saved_.count();
    status_.write(status);
  }
  /// The run has come to its end in order.
  void finish() { snapshots_.remove_all(); }
  void flush_status() const { status_.flush(1.0); }

  void fill(RunTotals& totals) const {
    totals.lateness = lateness_.totals();
    if (!tracked_) return;
    tracked_->fill(totals.tracking);
    totals.tracking.jumps = engine_.tracked().jumps();
  }
  [[nodiscard]] std::uint64_t recording_ns() const { return recording_ns_; }
  [[nodiscard]] bool was_interrupted() const { return stop_announced_; }

 private:
  /// idle() is not called while a plugin computes, and a station without status counts as dead: controllers of real robots send STOP.
  void tell_of(const std::string& plugin) {
    const auto now = Clock::now();
    if (now < next_status_) return;
    next_status_ = now + kStatusPeriod;
    RunProgress progress = this->progress();
    progress.waiting_for = "the station's plugin " + plugin;
    publish_status(session_.started() ? kilotwin_open_RUNNING : kilotwin_open_STARTING, progress);
  }

  /// Samples that came until now count for this tick; memberships that they end or begin are announced.
  void follow_tracked(Tick now) {
    const RunPlan& plan = session_.plan();
    const double pace = plan.pace > 0 ? plan.pace : 1;
    const double since_first_s =
        plan.pace > 0 ? session_.wall_s() * plan.pace : plan.tick_length.seconds_at(Tick{now - session_.first()});
    const double now_s = plan.tick_length.seconds_at(session_.first()) + since_first_s;
    engine_.take(tracked_->samples_of(now, static_cast<std::int64_t>(now_s * kNominalClockHz), pace, observer_));
    for (const MembershipChange& change : tracked_->changes(engine_.tracked())) {
      Directive directive;
      directive.kind = DirectiveKind::kMembership;
      directive.membership = change;
      announce(now, directive);
    }
  }

  /// Writes the part of the checkpoint of the tick whose state hash is the last one known, if there is one. The state hash
  /// is known of no tick beyond that at which the station stands, so a part that comes to be saved is never too late.
  void write_checkpoint() {
    if (unfinished_.empty() || unfinished_.front().first != metrics_.hash_tick()) return;
    auto& [tick, part] = unfinished_.front();
    part.mutable_station()->set_hash_chain(metrics_.chain());
    observer_.saved();
    write_checkpoint_part(context_.run_directory, session_.plan(), tick, session_.plan().station(), part);
    written_ = tick;
    unfinished_.pop_front();
  }

  /// Finds that the checkpoint whose part the station wrote last is complete. Where federates have disks of their own, it is once
  /// all have stepped beyond it: each saves a tick before it leaves it.
  void await_parts() {
    if (written_ == saved_) return;
    if (metrics_.hash_tick() > written_ || is_complete(checkpoint_directory(context_.run_directory, written_)))
      saved_ = written_;
  }

  /// Input that comes before the first tick waits for it.
  void announce(Tick now) {
    if (!session_.started()) return;
    for (const Directive& directive : external_input_.take()) announce(now, directive);
    if (interrupted() != 0 && !stop_announced_) {
      stop_announced_ = true;
      Directive stop;
      stop.kind = DirectiveKind::kStop;
      announce(now, stop);
    }
    if (!session_.paused() && snapshots_.due(Clock::now())) {
      Directive save;
      save.kind = DirectiveKind::kCheckpoint;
      snapshots_.taken(announce(now, save));
    }
  }

  /// Returns from which tick it counts.
  Tick announce(Tick now, const Directive& unstamped) {
    const Directive directive = ingress_.stamp(now, unstamped);
    session_.announce(directive);
    observer_.input(directive);
    return directive.tick;
  }

  void publish_packets(Tick now) {
    PublicStationPacket sample{};
    sample.run = session_.plan().run();
    for (const OverheadPacket& packet : overhead_.frame.packets) {
      sample.number = packets_published_++;
      sample.offset_s = packet.offset_cycles() / kNominalClockHz;
      sample.time_s = session_.plan().tick_length.seconds_at(now) + sample.offset_s;
      sample.command = static_cast<std::uint8_t>(packet.command);
      std::copy(packet.message.begin(), packet.message.end(), sample.message);
      std::copy(packet.rest.begin(), packet.rest.end(), sample.rest);
      station_packets_.write(sample);
    }
  }

  void publish_robots(Tick now) {
    PublicRobotState state{};
    state.run = session_.plan().run();
    state.time_s = session_.plan().tick_length.seconds_at(now);
    for (std::uint32_t robot = 0; robot < swarm_.robots(); ++robot) {
      state.robot = robot;
      state.x_mm = swarm_.x_mm[robot];
      state.y_mm = swarm_.y_mm[robot];
      state.heading_rad = swarm_.heading_rad[robot];
      state.led = swarm_.led[robot];
      robots_.write(state);
    }
  }

  Session& session_;
  const ServiceContext& context_;
  StationEngine& engine_;
  RunMetrics& metrics_;
  RunObserver& observer_;
  StationOutputs outputs_{session_.plan(), context_.run_directory, context_.first()};
  Ingress ingress_;
  Snapshots snapshots_;
  ExternalInput external_input_;
  Input<BodyFrame> bodies_;
  Input<ActuationFrame> actuation_;
  Output<OverheadFrame> overhead_;
  // Only where there are tracked robots.
  std::optional<TrackedRobots> tracked_;
  std::optional<Output<TrackingFrame>> tracking_;
  SwarmView swarm_{session_.plan().robots(), session_.plan().movables(), session_.plan().memory.size()};
  dds::Writer<PublicRunStatus> status_;
  dds::Writer<PublicRobotState> robots_;
  dds::Writer<PublicStationPacket> station_packets_;
  std::uint64_t packets_published_ = 0;
  const bool records_packets_ = RecordedEvents(session_.plan()).station;
  Clock::time_point next_robots_{}, next_status_{};
  SwarmStream swarm_stream_;
  Pace pace_{session_.plan()};
  Lateness lateness_{session_.plan()};
  std::deque<std::pair<Tick, proto::CheckpointPart>> unfinished_;  // without their state hash
  Tick written_{0}, saved_{0};  // of the last checkpoint: the station's part of it; all parts
  std::uint64_t recording_ns_ = 0;
  bool stop_announced_ = false;
};

}  // namespace

RunTotals run_service(const RunPlan& plan, const ServiceContext& context, RunObserver& observer) {
  StationEngine engine(plan, context.run_directory);
  if (context.resumed) engine.load(context.first(), context.resumed->station());
  Session session(plan, plan.station(), context.transport, context.first(), context.inputs,
                  context.give_up_after_s);
  // The chain of a resumed run goes on from H at the checkpoint: its first own sum is that of the tick after.
  RunMetrics metrics(plan, session.participant(), first_hashed(context.first()),
                     context.resumed ? context.resumed->hash_chain() : 0);
  StationFederate federate(session, engine, metrics, observer, context);
  RunTotals totals;
  try {
    federate.publish_status(kilotwin_open_STARTING, federate.progress());
    session.run(federate);
    const auto patience = Clock::now() + std::chrono::duration<double>(kMetricsPatience_s);
    while (!metrics.complete() && Clock::now() < patience)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } catch (const UserError&) {
    throw;
  } catch (const std::exception& error) {
    totals.failure = error.what();
  }
  try {
    federate.settle();
    if (totals.failure.empty()) federate.finish();
  } catch (const std::exception& error) {
    if (totals.failure.empty()) totals.failure = error.what();
  }
  totals.first = context.first();
  totals.last = metrics.hash_tick();
  totals.state_hash = metrics.chain();
  totals.wall_s = session.wall_s();
  metrics.fill(totals);
  totals.station = station_totals(plan, engine, totals.last);
  // The recorder works within the station's step.
  std::uint64_t& station_ns = totals.work_ns[static_cast<std::size_t>(Work::kStation)];
  station_ns -= std::min(station_ns, federate.recording_ns());
  totals.work_ns[static_cast<std::size_t>(Work::kRecording)] = federate.recording_ns();
  federate.fill(totals);
  totals.stopped_early = session.schedule().stopped_early();
  if (totals.failure.empty() && federate.was_interrupted()) totals.failure = "interrupted";
  if (totals.failure.empty() && totals.last != session.schedule().last()) {
    totals.failure =
        fmt::format("the state hash is known up to tick {} of {} only: a service left without its last count",
                    totals.last.count(), session.schedule().last().count());
  }
  RunProgress progress = federate.progress();
  progress.waiting_for = totals.failure;
  federate.publish_status(totals.failure.empty() ? kilotwin_open_ENDED : kilotwin_open_BROKEN, progress);
  federate.flush_status();
  return totals;
}

}  // namespace kilotwin::ark

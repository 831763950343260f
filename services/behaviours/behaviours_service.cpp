#include "services/behaviours/behaviours_service.hpp"

#include <fmt/format.h>

#include <optional>

#include "core/base/say.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/observed.hpp"
#include "core/logs/robot_logs.hpp"
#include "idl/recording.pb.h"
#include "services/behaviours/eeprom_files.hpp"
#include "services/behaviours/engine.hpp"
#include "services/behaviours/host_observer.hpp"
#include "services/behaviours/running_note.hpp"
#include "services/behaviours/watchdog.hpp"

namespace kilotwin::behaviours {
namespace {

class BehavioursFederate : public Federate {
 public:
  BehavioursFederate(Session& session, HostId host, BehavioursEngine& engine, const ServiceContext& context)
      : session_(session),
        context_(context),
        host_(host),
        engine_(engine),
        radio_(session, topics::radio(host.value()), {session.plan().radio()}),
        actuation_(session, topics::actuation()),
        printed_failures_(engine.failures().size()),
        logs_(context.run_directory, session.plan().tick_length, context.first(),
              [&plan = session.plan(), host](std::uint32_t robot) {
                return plan.share(host).contains(robot) && !plan.firmware(robot);
              }) {
    const RunPlan& plan = session.plan();
    if (plan.any_tracked()) tracking_.emplace(session, topics::tracking(), std::vector{plan.station()});
    if (!plan.hosts_see_bodies()) return;
    bodies_.emplace(session, topics::bodies(), plan.all_physics());
    swarm_.emplace(plan.robots(), plan.movables(), plan.memory.size());
  }

  void publish(Tick now) override {
    engine_.emit(actuation_.frame);
    actuation_.write();
    observer_.at(now, observed_);
  }

  void step(Tick from) override {
    if (swarm_) swarm_->gather(from, bodies_->at(from));
    engine_.step(from, *radio_.at(from)[0], swarm_ ? &*swarm_ : nullptr,
                 {tracking_ ? tracking_->at(from)[0] : nullptr, session_.schedule().memberships()});
    observer_.stepped(from, observed_);
    for (const auto& printed : engine_.printed()) logs_.write(from, printed.robot, printed.text);
    for (; printed_failures_ < engine_.failures().size(); ++printed_failures_) {
      const auto& failure = engine_.failures()[printed_failures_];
      say(fmt::format("robot {} failed at {:.3f} s: {}", failure.robot,
                      session_.plan().tick_length.seconds_at(from), failure.text));
    }
    for (; printed_warnings_ < engine_.warnings().size(); ++printed_warnings_) {
      const auto& warning = engine_.warnings()[printed_warnings_];
      say(fmt::format("robot {} at {:.3f} s: {}", warning.robot, session_.plan().tick_length.seconds_at(from),
                      warning.text));
    }
  }

  [[nodiscard]] std::uint64_t hash_part() const override { return engine_.hash_part(); }

  void save(Tick now) override {
    logs_.flush();  // a run that resumes from this checkpoint keeps the lines printed before it
    proto::CheckpointPart part;
    engine_.save(*part.mutable_behaviours());
    write_checkpoint_part(context_.run_directory, session_.plan(), now, session_.plan().behaviours(host_), part);
  }

  void count(WireMetrics& metrics, bool last) override {
    metrics.robots_failed = engine_.robots_failed();
    lend_observations(observed_, octets_, metrics);
    if (!last) return;
    write_eeproms(engine_, session_.plan().share(host_), context_.run_directory);
    logs_.flush();
  }

 private:
  Session& session_;
  const ServiceContext& context_;
  const HostId host_;
  BehavioursEngine& engine_;
  Input<RadioFrame> radio_;
  // Only if RunPlan::hosts_see_bodies().
  std::optional<Input<BodyFrame>> bodies_;
  std::optional<SwarmView> swarm_;
  std::optional<Input<TrackingFrame>> tracking_;  // only where there are tracked robots
  Output<ActuationFrame> actuation_;
  std::size_t
      printed_failures_;  // a resumed engine starts with the failures of its checkpoint, printed by the earlier run
  RobotLogs logs_;
  std::size_t printed_warnings_ = 0;
  HostObserver observer_{session_.plan(), host_, engine_};
  proto::Observations observed_;  // since the last metrics sample
  std::string octets_;            // of the last metrics sample
};

}  // namespace

void run_service(const RunPlan& plan, HostId host, const ServiceContext& context) {
  BehavioursEngine engine(plan, host, ProgramSet::load(plan, context.run_directory));
  if (context.resumed) engine.load(context.first(), context.resumed->behaviours());
  Session session(plan, plan.behaviours(host), context.transport, context.first(), context.inputs,
                  context.give_up_after_s);
  RunningNote note(context.run_directory, host);
  engine.note_running_in(note.place());
  const Watchdog watchdog({&engine});
  BehavioursFederate federate(session, host, engine, context);
  session.run(federate);
}

}  // namespace kilotwin::behaviours

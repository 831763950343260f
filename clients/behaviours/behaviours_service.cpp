#include "clients/behaviours/behaviours_service.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <thread>

#include "clients/behaviours/engine.hpp"
#include "core/federation/frame_io.hpp"

namespace kilotwin::behaviours {
namespace {

/// How long a program may run without returning before it is named.
constexpr auto kHangs = std::chrono::milliseconds(1000);

/// Says which robot's program does not return: the engine itself cannot, as it waits for it.
class Watchdog {
 public:
  Watchdog(const BehavioursEngine& engine, std::string name) : engine_(engine), name_(std::move(name)) {
    thread_ = std::thread([this] { watch(); });
  }
  ~Watchdog() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

 private:
  void watch() {
    std::unique_lock lock(mutex_);
    std::optional<BehavioursEngine::Running> before;
    std::uint64_t named = 0;
    while (!wake_.wait_for(lock, kHangs, [this] { return done_; })) {
      const auto running = engine_.running();
      if (running && before && running->entry == before->entry && running->entry != named) {
        named = running->entry;
        fmt::print(stderr, "{}: the program of robot {} has not returned for over 1 s; it may loop for ever\n", name_, running->robot);
      }
      before = running;
    }
  }

  const BehavioursEngine& engine_;
  const std::string name_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

class BehavioursFederate : public Federate {
 public:
  BehavioursFederate(Session& session, HostId host, BehavioursEngine& engine, const ServiceContext& context)
      : session_(session),
        context_(context),
        host_(host),
        engine_(engine),
        radio_(session, topics::radio(host.value()), {session.plan().comm()}),
        actuation_(session, topics::actuation()) {}

  void publish(Tick) override {
    engine_.emit(actuation_.frame);
    actuation_.write();
  }

  void step(Tick from) override {
    engine_.step(from, *radio_.at(from)[0]);
    for (; told_ < engine_.failures().size(); ++told_) {
      const auto& failure = engine_.failures()[told_];
      fmt::print(stderr, "robot {} failed at {:.3f} s: {}\n", failure.robot, session_.plan().tick_length.seconds_at(from), failure.text);
    }
  }

  [[nodiscard]] std::uint64_t hash_part() const override { return engine_.hash_part(); }

  void save(Tick now) override {
    proto::CheckpointPart part;
    engine_.save(*part.mutable_behaviours());
    write_checkpoint_part(context_.run_directory, session_.plan(), now, session_.plan().behaviours(host_), part);
  }

  void count(WireLedger& ledger, bool) override { ledger.robots_failed = engine_.robots_failed(); }

 private:
  Session& session_;
  const ServiceContext& context_;
  const HostId host_;
  BehavioursEngine& engine_;
  Input<RadioFrame> radio_;
  Output<ActuationFrame> actuation_;
  std::size_t told_ = 0;  // of the engine's failures
};

}  // namespace

void run_service(const RunPlan& plan, HostId host, const ServiceContext& context) {
  BehavioursEngine engine(plan, host, ProgramSet::load(plan.manifest, context.run_directory));
  if (context.resumed) engine.load(context.first(), context.resumed->behaviours());
  Session session(plan, plan.behaviours(host), context.transport, context.first());
  const Watchdog watchdog(engine, plan.name(plan.behaviours(host)));
  BehavioursFederate federate(session, host, engine, context);
  session.run(federate);
}

}  // namespace kilotwin::behaviours

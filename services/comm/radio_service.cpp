#include "services/comm/radio_service.hpp"

#include "core/federation/frame_io.hpp"
#include "core/federation/observed.hpp"
#include "services/comm/radio_engine.hpp"
#include "services/comm/radio_observer.hpp"

namespace kilotwin::comm {
namespace {

class CommFederate : public Federate {
 public:
  CommFederate(Session& session, RadioEngine& engine, const ServiceContext& context)
      : session_(session),
        context_(context),
        engine_(engine),
        bodies_(session, topics::bodies(), session.plan().all_physics()),
        actuation_(session, topics::actuation(), session.plan().all_behaviours()),
        overhead_(session, topics::overhead(), {session.plan().station()}),
        swarm_(session.plan().robots(), session.plan().movables(), session.plan().memory.size()) {
    for (std::uint32_t host = 0; host < session.plan().hosts; ++host) {
      radio_out_.push_back(std::make_unique<Output<RadioFrame>>(session, topics::radio(host)));
    }
  }

  void publish(Tick now) override {
    observer_.at(now, observed_);
    for (std::uint32_t host = 0; host < radio_out_.size(); ++host) {
      engine_.emit(HostId{host}, radio_out_[host]->frame);
      radio_out_[host]->write();
    }
  }

  void step(Tick from) override {
    swarm_.gather(from, bodies_.at(from));
    swarm_.gather(actuation_.at(from));
    engine_.step(from, {swarm_, *overhead_.at(from)[0]});
    observer_.stepped(from, observed_);
  }

  [[nodiscard]] std::uint64_t hash_part() const override { return engine_.hash_part(); }

  void save(Tick now) override {
    proto::CheckpointPart part;
    engine_.save(*part.mutable_radio());
    write_checkpoint_part(context_.run_directory, session_.plan(), now, session_.plan().radio(), part);
  }

  void count(WireMetrics& metrics, bool last) override {
    const auto& counters = engine_.counters();
    metrics.attempted = counters.attempted;
    metrics.sent = counters.sent;
    metrics.received = counters.received;
    metrics.collided = counters.collided;
    lend_observations(observed_, octets_, metrics);
    if (!last) return;
    if (engine_.firmware() != nullptr) engine_.firmware()->flush_logs();
    for (const PairCount& pair : engine_.pair_counts()) {
      receiver_.push_back(pair.receiver);
      sender_.push_back(pair.sender);
      count_.push_back(pair.count);
    }
    for (const RadioCount& radio : engine_.radio_counts()) {
      attempted_.push_back(radio.attempted);
      robot_sent_.push_back(radio.sent);
      received_.push_back(radio.received);
      collided_.push_back(radio.collided);
      backed_off_.push_back(radio.backed_off);
    }
    const auto lend = [](auto& sequence, std::vector<std::uint32_t>& values) {
      sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
      sequence._buffer = values.data();
    };
    lend(metrics.pair_receiver, receiver_);
    lend(metrics.pair_sender, sender_);
    lend(metrics.pair_count, count_);
    lend(metrics.robot_attempted, attempted_);
    lend(metrics.robot_sent, robot_sent_);
    lend(metrics.robot_received, received_);
    lend(metrics.robot_collided, collided_);
    lend(metrics.robot_backed_off, backed_off_);
  }

 private:
  Session& session_;
  const ServiceContext& context_;
  RadioEngine& engine_;
  Input<BodyFrame> bodies_;
  Input<ActuationFrame> actuation_;
  Input<OverheadFrame> overhead_;
  SwarmView swarm_;
  std::vector<std::unique_ptr<Output<RadioFrame>>> radio_out_;
  RadioObserver observer_{session_.plan(), engine_};
  proto::Observations observed_;  // since the last metrics sample
  // The data to which the last metrics sample points.
  std::string octets_;
  std::vector<std::uint32_t> receiver_, sender_, count_;
  std::vector<std::uint32_t> attempted_, robot_sent_, received_, collided_, backed_off_;
};

}  // namespace

void run_service(const RunPlan& plan, const ServiceContext& context, std::unique_ptr<FirmwareRobots> firmware) {
  RadioEngine engine(plan, std::move(firmware));
  if (context.resumed) engine.load(context.first(), context.resumed->radio());
  Session session(plan, plan.radio(), context.transport, context.first(), context.inputs, context.give_up_after_s);
  CommFederate federate(session, engine, context);
  session.run(federate);
}

}  // namespace kilotwin::comm

#include "services/physics/physics_service.hpp"

#include <optional>

#include "core/federation/frame_io.hpp"
#include "services/physics/engine.hpp"

namespace kilotwin::physics {
namespace {

std::vector<FederateId> federates_of(const RunPlan& plan, const std::vector<PartitionId>& partitions) {
  std::vector<FederateId> result;
  result.reserve(partitions.size());
  for (const PartitionId p : partitions) result.push_back(plan.physics(p));
  return result;
}

class PhysicsFederate : public Federate {
 public:
  PhysicsFederate(Session& session, PartitionId partition, std::unique_ptr<Engine> engine,
                  const ServiceContext& context)
      : session_(session),
        context_(context),
        partition_(partition),
        engine_(std::move(engine)),
        ghosts_(session, topics::ghosts(partition.value()), federates_of(session.plan(), engine_->neighbours())),
        actuation_(session, topics::actuation(), session.plan().all_behaviours()),
        bodies_(session, topics::bodies()) {
    if (session.plan().any_tracked())
      tracking_.emplace(session, topics::tracking(), std::vector{session.plan().station()});
    for (const PartitionId neighbour : engine_->neighbours()) {
      ghosts_out_.push_back(std::make_unique<Output<BodyFrame>>(session, topics::ghosts(neighbour.value())));
    }
  }

  void publish(Tick) override {
    for (std::size_t i = 0; i < ghosts_out_.size(); ++i) {
      engine_->emit_ghosts(engine_->neighbours()[i], ghosts_out_[i]->frame);
      ghosts_out_[i]->write();
    }
    engine_->emit_bodies(bodies_.frame);
    bodies_.write();
  }

  void step(Tick from) override {
    engine_->step(from, {ghosts_.at(from), actuation_.at(from), tracking_ ? tracking_->at(from)[0] : nullptr,
                         session_.schedule().memberships(), session_.schedule().relocations()});
  }

  [[nodiscard]] std::uint64_t hash_part() const override { return engine_->hash_part(); }
  void count(WireMetrics& metrics, bool) override {
    metrics.bodies_without_space = engine_->bodies_without_space();
  }

  void save(Tick now) override {
    proto::CheckpointPart part;
    engine_->save(*part.mutable_physics());
    write_checkpoint_part(context_.run_directory, session_.plan(), now, session_.plan().physics(partition_), part);
  }

 private:
  Session& session_;
  const ServiceContext& context_;
  const PartitionId partition_;
  std::unique_ptr<Engine> engine_;
  Input<BodyFrame> ghosts_;
  Input<ActuationFrame> actuation_;
  std::optional<Input<TrackingFrame>> tracking_;
  Output<BodyFrame> bodies_;
  std::vector<std::unique_ptr<Output<BodyFrame>>> ghosts_out_;
};

}  // namespace

void run_service(const RunPlan& plan, PartitionId partition, const ServiceContext& context) {
  std::unique_ptr<Engine> engine = make_engine(plan, partition);
  if (context.resumed) engine->load(context.first(), context.resumed->physics());
  Session session(plan, plan.physics(partition), context.transport, context.first(), context.inputs,
                  context.give_up_after_s);
  PhysicsFederate federate(session, partition, std::move(engine), context);
  session.run(federate);
}

}  // namespace kilotwin::physics

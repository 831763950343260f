#include "services/physics/engine.hpp"

#include "core/base/error.hpp"
#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/kinematic_engine.hpp"
#include "services/physics/planar_engine.hpp"

namespace kilotwin::physics {

std::unique_ptr<Engine> make_engine(const RunPlan& plan, PartitionId partition) {
  switch (plan.experiment().physics().engine()) {
    case proto::Physics::PLANAR: return std::make_unique<PlanarEngine>(plan, partition);
    case proto::Physics::KINEMATIC: return std::make_unique<KinematicEngine>(plan, partition);
  }
  throw UserError("physics.engine: unknown engine; PLANAR or KINEMATIC would be right");
}

double ghost_margin_mm(const RunPlan& plan) {
  const DriveModel drive(plan);
  if (plan.experiment().physics().engine() == proto::Physics::KINEMATIC)
    return KinematicEngine::margin_mm(plan, drive);
  return ContactLimits(plan, drive).margin_mm;
}

}  // namespace kilotwin::physics

#include "services/physics/engine.hpp"

#include "core/base/error.hpp"
#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/kinematic_engine.hpp"
#include "services/physics/ode_engine.hpp"
#include "services/physics/planar_engine.hpp"

namespace kilotwin::physics {

std::unique_ptr<Engine> make_engine(const RunPlan& plan, PartitionId partition) {
  switch (plan.experiment().physics().engine()) {
    case proto::Physics::PLANAR: return std::make_unique<PlanarEngine>(plan, partition);
    case proto::Physics::KINEMATIC: return std::make_unique<KinematicEngine>(plan, partition);
    case proto::Physics::ODE: return std::make_unique<OdeEngine>(plan, partition);
  }
  throw UserError("physics.engine: unknown engine; PLANAR, KINEMATIC or ODE would be right");
}

double ghost_margin_mm(const RunPlan& plan) {
  const DriveModel drive(plan);
  const auto reach_mm = [&] {
    switch (plan.experiment().physics().engine()) {
      case proto::Physics::PLANAR: return ContactLimits(plan, drive).margin_mm;
      case proto::Physics::KINEMATIC: return KinematicEngine::margin_mm(plan, drive);
      case proto::Physics::ODE: return OdeLimits(plan, drive).margin_mm;
    }
    throw UserError("physics.engine: unknown engine; PLANAR, KINEMATIC or ODE would be right");
  };
  return Population::margin_mm(plan, drive, reach_mm());
}

}  // namespace kilotwin::physics

#include "services/physics/engine.hpp"

#include "core/base/error.hpp"
#include "core/plan/physics_settings.hpp"
#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/kinematic_engine.hpp"
#include "services/physics/ode_engine.hpp"
#include "services/physics/planar_engine.hpp"

namespace kilotwin::physics {

std::unique_ptr<Engine> make_engine(const RunPlan& plan, PartitionId partition) {
  switch (plan.physics_settings().engine) {
    case PhysicsSettings::Engine::kPlanar: return std::make_unique<PlanarEngine>(plan, partition);
    case PhysicsSettings::Engine::kKinematic: return std::make_unique<KinematicEngine>(plan, partition);
    case PhysicsSettings::Engine::kOde: return std::make_unique<OdeEngine>(plan, partition);
  }
  throw UserError("physics.engine: unknown engine; PLANAR, KINEMATIC or ODE would be right");
}

double ghost_margin_mm(const RunPlan& plan) {
  const DriveModel drive(plan);
  const auto reach_mm = [&] {
    switch (plan.physics_settings().engine) {
      case PhysicsSettings::Engine::kPlanar: return ContactLimits(plan, drive).margin_mm;
      case PhysicsSettings::Engine::kKinematic: return KinematicEngine::margin_mm(plan, drive);
      case PhysicsSettings::Engine::kOde: return OdeLimits(plan, drive).margin_mm;
    }
    throw UserError("physics.engine: unknown engine; PLANAR, KINEMATIC or ODE would be right");
  };
  return Population::margin_mm(plan, drive, reach_mm());
}

}  // namespace kilotwin::physics

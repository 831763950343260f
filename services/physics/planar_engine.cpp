#include "services/physics/planar_engine.hpp"

namespace kilotwin::physics {

PlanarEngine::PlanarEngine(const RunPlan& plan, PartitionId partition)
    : PlanarEngine(plan, partition, DriveModel(plan)) {}

PlanarEngine::PlanarEngine(const RunPlan& plan, PartitionId partition, const DriveModel& drive)
    : PopulationEngine(plan, partition, drive, ContactLimits(plan, drive).margin_mm), contact_(plan, drive) {}

void PlanarEngine::move(Tick from, const Inputs&) {
  Bodies& known = population_.known();
  if (!contact_.find(known, population_.own(), population_.duties())) return;
  set_off(from);
  contact_.move(known, drives_);
}

void PlanarEngine::set_off(Tick from) {
  const Bodies& known = population_.known();
  const std::vector<Duties>& duties = population_.duties();
  const DriveModel& drive = population_.drive();
  drives_.reserve(known.size());
  drives_.count = 0;
  for (std::uint32_t i = 0; i < known.size(); ++i) {
    if (!duties[i].any() || !contact_.asks_drive(i)) continue;
    drive.add(drives_, i, known.robot[i], from, duties[i], known.heading_rad[i], contact_.drive_part(i));
  }
  drive.integrate(drives_);
}

}  // namespace kilotwin::physics

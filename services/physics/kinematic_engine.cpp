#include "services/physics/kinematic_engine.hpp"

#include <algorithm>

namespace kilotwin::physics {

double KinematicEngine::margin_mm(const RunPlan& plan, const DriveModel& drive) {
  return drive.top_speed_mm_s() * plan.tick_length.seconds();
}

KinematicEngine::KinematicEngine(const RunPlan& plan, PartitionId partition)
    : KinematicEngine(plan, partition, DriveModel(plan)) {}

KinematicEngine::KinematicEngine(const RunPlan& plan, PartitionId partition, const DriveModel& drive)
    : PopulationEngine(plan, partition, drive, margin_mm(plan, drive)),
      x_limit_mm_(plan.world.arena.stated_width_mm() / 2 - kRobotRadius_mm),
      y_limit_mm_(plan.world.arena.stated_height_mm() / 2 - kRobotRadius_mm) {}

void KinematicEngine::move(Tick from, const Inputs&) {
  Bodies& known = population_.known();
  const std::vector<std::uint8_t>& own = population_.own();
  const std::vector<Duties>& duties = population_.duties();
  const std::vector<std::uint8_t>& driven = population_.driven();
  drives_.reserve(known.size());
  drives_.count = 0;
  for (std::uint32_t i = 0; i < known.size(); ++i) {
    if (driven[i] == 0 || (!own.empty() && own[i] == 0)) continue;
    population_.drive().add(drives_, i, known.robot[i], from, duties[i], known.heading_rad[i], 1);
  }
  population_.complete(from, drives_);
  for (std::size_t d = 0; d < drives_.count; ++d) {
    const std::uint32_t i = drives_.body[d];
    known.x_mm[i] = std::clamp(known.x_mm[i] + drives_.x_mm[d], -x_limit_mm_, x_limit_mm_);
    known.y_mm[i] = std::clamp(known.y_mm[i] + drives_.y_mm[d], -y_limit_mm_, y_limit_mm_);
    known.heading_rad[i] = wrapped(drives_.heading_rad[d] + drives_.turn_rad[d]);
  }
}

}  // namespace kilotwin::physics

/// The kinematic engine: differential drive without contact, for sweeps of what contact does not touch. Robots pass through
/// each other; the walls of the arena hold them: the centre of a disc that would come closer to a wall than its radius is put
/// to that distance, and the way along the wall remains. A robot depends on itself alone, so that ghosts serve the
/// hand-over only and results are the same for any partitions.
#pragma once

#include "services/physics/population.hpp"

namespace kilotwin::physics {

class KinematicEngine final : public PopulationEngine {
 public:
  KinematicEngine(const RunPlan&, PartitionId);

  /// The way of the fastest robot in a tick.
  [[nodiscard]] static double margin_mm(const RunPlan&, const DriveModel&);

 private:
  KinematicEngine(const RunPlan&, PartitionId, const DriveModel&);
  void move(Tick from, const Inputs&) override;

  double x_limit_mm_, y_limit_mm_;  ///< the centre of a disc stays within +-limit
  Drives drives_;                   ///< within a step
};

}  // namespace kilotwin::physics

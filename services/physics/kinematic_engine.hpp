/// The kinematic engine: differential drive without contact, for sweeps of quantities that contact does not affect. Robots
/// pass through each other. The arena's walls hold them: a disc closer to a wall than its radius is put back to that
/// distance, and its motion along the wall remains. A robot depends on itself only. Ghosts therefore serve the hand-over
/// alone, and results are the same for any partitions.
#pragma once

#include "services/physics/population.hpp"

namespace kilotwin::physics {

class KinematicEngine final : public PopulationEngine {
 public:
  KinematicEngine(const RunPlan&, PartitionId);

  /// Largest distance that a robot can travel in a tick.
  [[nodiscard]] static double margin_mm(const RunPlan&, const DriveModel&);

 private:
  KinematicEngine(const RunPlan&, PartitionId, const DriveModel&);
  void move(Tick from, const Inputs&) override;

  double x_limit_mm_, y_limit_mm_;  ///< the centre of a disc stays within +-limit
  Drives drives_;                   ///< within a step
};

}  // namespace kilotwin::physics

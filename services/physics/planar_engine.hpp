/// The planar engine: differential drive and contact of discs, over a partition of the arena.
///
///   move from tick k: find   : who may touch whom, and which of the others own bodies depend on
///                     drive  : motors of k -> wanted motion of these
///                     contact: S Jacobi passes over these
/// Own bodies come out bit for bit as if one partition computed all: a body depends on one hop of neighbours per sub-step,
/// and the margin holds S hops. Others are computed as far as own ones depend on them, and their poses are not used.
#pragma once

#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/population.hpp"

namespace kilotwin::physics {

class PlanarEngine final : public PopulationEngine {
 public:
  PlanarEngine(const RunPlan&, PartitionId);

 private:
  PlanarEngine(const RunPlan&, PartitionId, const DriveModel&);
  void move(Tick from, const Inputs&) override;
  void set_off(Tick from);

  ContactSolver contact_;
  Drives drives_;  ///< within a step
};

}  // namespace kilotwin::physics

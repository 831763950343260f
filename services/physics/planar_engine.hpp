/// The planar engine: differential drive and contact of discs, over a partition of the arena.
///
///   step from tick k: known  = bodies listed at k + ghosts of k + tracked robots, within the margin of the rectangle
///                     own    = those of the known whose pose at k lies in the rectangle
///                     find   : who may touch whom, and which of the others own bodies depend on
///                     drive  : motors of k -> wanted motion of these
///                     contact: S Jacobi passes over these
///                     listed at k+1 = own
/// Own bodies come out bit for bit as if one partition computed all: a body depends on one hop of neighbours per sub-step,
/// and the margin holds S hops. Others are computed as far as own ones depend on them, and their poses are not used.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/physics/bodies.hpp"
#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/engine.hpp"
#include "services/physics/merge.hpp"

namespace kilotwin::physics {

class PlanarEngine final : public Engine {
 public:
  PlanarEngine(const RunPlan&, PartitionId);

  void step(Tick from, const Inputs&) override;
  void emit_bodies(BodyFrame&) const override;
  void emit_ghosts(PartitionId neighbour, BodyFrame&) const override;
  [[nodiscard]] const std::vector<PartitionId>& neighbours() const override { return neighbours_; }
  [[nodiscard]] std::uint64_t hash_part() const override;
  void save(proto::PhysicsState&) const override;
  void load(Tick, std::span<const proto::PhysicsState* const> parts) override;

 private:
  void take_tracked(std::span<const TrackedPoseInput>);
  void gather(std::span<const BodyFrame* const> ghosts);
  void read_motors(Tick from, std::span<const ActuationFrame* const>);
  void set_off(Tick from);
  void list_own();
  [[nodiscard]] bool is_own(double x_mm, double y_mm) const { return rectangle_.contains(x_mm, y_mm); }

  PartitionGrid grid_;
  PartitionId partition_;
  Rectangle rectangle_;
  std::uint32_t robots_;
  std::vector<std::uint8_t> is_tracked_;  ///< per robot; empty where there is none
  DriveModel drive_;
  ContactSolver contact_;
  std::vector<PartitionId> neighbours_;

  Tick tick_;
  Bodies listed_;
  Bodies tracked_;  ///< all tracked robots, wherever they are

  // Within a step.
  Bodies known_, previous_;        ///< of the present step and of the one before
  std::vector<std::uint8_t> own_;  ///< per known body, by its pose before the step; empty with one partition
  Merge merge_;
  std::vector<const ActuationFrame*> frames_;
  std::vector<Duties> duties_;  ///< per known body
  Drives drives_;
};

}  // namespace kilotwin::physics

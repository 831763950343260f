/// The planar engine: differential drive and contact of discs, over a partition of the arena.
///
///   move from tick k: find   : possible contacts, and the other bodies that own bodies depend on
///                     drive  : motors of k -> velocity of each of these bodies without contact
///                     contact: S Jacobi passes over these bodies
/// Own bodies get the same bits as with a single partition: a body depends on one hop of neighbours per sub-step, and the
/// margin covers S hops. Bodies of other partitions are computed only as far as own bodies depend on them; their resulting
/// poses are not used.
#pragma once

#include "services/physics/contact.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/population.hpp"

namespace kilotwin::physics {

class PlanarEngine final : public PopulationEngine {
 public:
  PlanarEngine(const RunPlan&, PartitionId);

  void emit_bodies(BodyFrame&) const override;
  void emit_ghosts(PartitionId neighbour, BodyFrame&) const override;
  [[nodiscard]] std::uint64_t hash_part() const override;
  void save(proto::PhysicsState&) const override;
  void load(Tick, std::span<const proto::PhysicsState* const> parts) override;

 private:
  PlanarEngine(const RunPlan&, PartitionId, const DriveModel&);
  void move(Tick from, const Inputs&) override;
  void relocated(const Relocation&) override;
  void read_ghosts(const Inputs&);
  void fill_drives(Tick from);
  void list_movables();
  void add_movables(BodyFrame&) const;
  [[nodiscard]] bool is_own(const MovableState& body) const { return rectangle_.contains(body.x_mm, body.y_mm); }

  PartitionGrid grid_;
  Rectangle rectangle_;
  double margin_mm_, slack_mm_;
  std::vector<double> reach_mm_;              ///< per movable body
  std::vector<std::uint8_t> own_movable_;     ///< per movable body, by its pose before the step
  std::vector<std::uint8_t> listed_movable_;  ///< per movable body: this partition publishes and hashes its state
  ContactSolver contact_;
  Drives drives_;  ///< within a step
};

}  // namespace kilotwin::physics

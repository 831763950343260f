/// What every physics engine offers: the bodies of one partition, advanced tick by tick. Engines are pure; they have no
/// clock, thread, I/O or network. Lengths mm, angles rad, frame of the arena.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/frames/frames.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::proto {
class PhysicsState;
}

namespace kilotwin::physics {

/// What a step from tick k reads; every frame is of tick k.
struct Inputs {
  std::span<const BodyFrame* const> ghosts;          ///< one per neighbour, in any order
  std::span<const ActuationFrame* const> actuation;  ///< in any order; a robot that no frame covers is at rest
  std::span<const TrackedPoseInput> tracked;         ///< alike for all partitions; the last of a robot counts
};

/// Ownership. The owner of a robot in the step from tick k is the partition whose rectangle holds its pose at k. It
/// computes the pose at k+1, and lists and hashes the robot at k+1 even where the robot has just left its rectangle; the
/// new owner finds the robot in the ghosts of k+1. At tick 0 and after load, a partition lists what lies in its rectangle.
/// So each robot is listed by exactly one partition at any tick.
class Engine {
 public:
  virtual ~Engine() = default;

  /// Advances from tick `from`, which must be the present one, to `from` + 1.
  virtual void step(Tick from, const Inputs&) = 0;
  /// The robots listed at the present tick, ascending ids.
  virtual void emit_bodies(BodyFrame&) const = 0;
  /// Those of the listed robots that `neighbour` must know. Tracked robots are left out: every partition knows them from
  /// the inputs.
  virtual void emit_ghosts(PartitionId neighbour, BodyFrame&) const = 0;
  /// Ascending; the partitions to and from which ghosts go.
  [[nodiscard]] virtual const std::vector<PartitionId>& neighbours() const = 0;
  /// Sum of entity_hash over the listed robots.
  [[nodiscard]] virtual std::uint64_t hash_part() const = 0;
  /// The listed robots; all partitions together save each robot once.
  virtual void save(proto::PhysicsState&) const = 0;
  /// Continues from what all partitions of any grid saved at `tick`. Throws RunError where a robot is missing, double or
  /// unknown.
  virtual void load(Tick tick, std::span<const proto::PhysicsState* const> parts) = 0;
};

/// The engine that the experiment names.
[[nodiscard]] std::unique_ptr<Engine> make_engine(const RunPlan&, PartitionId);

/// How far from a partition's rectangle a robot can be and still matter within one tick, mm. Partitions exchange ghosts
/// where grid.neighbours(p, ghost_margin_mm(plan)) says so.
[[nodiscard]] double ghost_margin_mm(const RunPlan&);

}  // namespace kilotwin::physics

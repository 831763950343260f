/// Interface of all physics engines: the bodies of one partition, advanced tick by tick. Engines are pure: no clock, thread,
/// I/O or network. Lengths in mm, angles in rad, in the arena's frame.
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

/// Inputs of a step from tick k. Every frame is of tick k.
struct Inputs {
  std::span<const BodyFrame* const> ghosts;          ///< one per neighbour, in any order
  std::span<const ActuationFrame* const> actuation;  ///< in any order; a robot in no frame is at rest
  const TrackingFrame* tracking = nullptr;           ///< where RunPlan::any_tracked(); alike for all partitions
  std::span<const MembershipChange> memberships{};   ///< that take effect in this step, in order
  std::span<const Relocation> relocations{};         ///< that take effect after this step, in order
};

/// Ownership: in the step from tick k, the partition whose rectangle contains a robot's pose at k owns the robot. It
/// computes the pose at k+1, and lists and hashes the robot at k+1 even if the robot has just left its rectangle. The next
/// owner finds the robot in the ghosts of k+1. At tick 0 and after load(), a partition lists the robots in its rectangle.
/// So exactly one partition lists each robot at any tick.
class Engine {
 public:
  virtual ~Engine() = default;

  /// Advances from tick `from`, which must be the current one, to `from` + 1.
  virtual void step(Tick from, const Inputs&) = 0;
  /// How often a tracked robot that this partition owns came to stand on another body since the start, or since load.
  [[nodiscard]] virtual std::uint32_t bodies_without_space() const = 0;
  /// Writes the robots listed at the current tick, in ascending ids.
  virtual void emit_bodies(BodyFrame&) const = 0;
  /// Writes the listed robots that `neighbour` must know, without tracked ones: every partition knows those from its inputs.
  virtual void emit_ghosts(PartitionId neighbour, BodyFrame&) const = 0;
  /// The partitions with which this one exchanges ghosts, ascending.
  [[nodiscard]] virtual const std::vector<PartitionId>& neighbours() const = 0;
  /// Sum of entity_hash over the listed robots.
  [[nodiscard]] virtual std::uint64_t hash_part() const = 0;
  /// Saves the listed robots; all partitions together save each robot once.
  virtual void save(proto::PhysicsState&) const = 0;
  /// Restores the state that all partitions of any grid saved at `tick`. Throws RunError if a robot is missing, unknown or
  /// occurs twice.
  virtual void load(Tick tick, std::span<const proto::PhysicsState* const> parts) = 0;
};

/// The engine that the experiment names.
[[nodiscard]] std::unique_ptr<Engine> make_engine(const RunPlan&, PartitionId);

/// Largest distance from a partition's rectangle at which a robot can affect own ones within one tick, mm. Partitions
/// exchange ghosts with grid.neighbours(p, ghost_margin_mm(plan)).
[[nodiscard]] double ghost_margin_mm(const RunPlan&);

}  // namespace kilotwin::physics

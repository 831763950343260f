/// The bodies that one partition has to do with, and what is common to all engines: who is whose, what goes to neighbours,
/// hashing, saving and loading. An engine moves bodies; the population says which.
///
///   begin(k): known = bodies listed at k + ghosts of k + tracked robots, within the margin of the rectangle
///             own   = those of the known whose pose at k lies in the rectangle
///   (the engine moves the own bodies among the known from k to k+1)
///   end():    listed at k+1 = own; what the model's effects remember
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/effects/arena_fields.hpp"
#include "core/effects/memory.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/engine.hpp"
#include "services/physics/merge.hpp"

namespace kilotwin::physics {

class Population {
 public:
  /// `reach_mm`: how far from the rectangle a robot can be and still matter to own ones within a tick, effects aside.
  Population(const RunPlan&, PartitionId, DriveModel, double reach_mm);

  /// How far from the rectangle robots must be known, mm: those within reach look at others and at what places remember.
  [[nodiscard]] static double margin_mm(const RunPlan&, const DriveModel&, double reach_mm);

  /// Applies tracked poses, gathers the known bodies and reads their motors. `from` must be the present tick.
  void begin(Tick from, const Inputs&);
  /// The present tick is the next one.
  void end();

  // Between begin() and end(): ascending ids.
  [[nodiscard]] Bodies& known() { return known_; }
  [[nodiscard]] const Bodies& known() const { return known_; }
  /// Per known body, whether the partition owns it; empty: all of them.
  [[nodiscard]] const std::vector<std::uint8_t>& own() const { return own_; }
  /// Per known body; 0 for tracked ones and those that no frame covers.
  [[nodiscard]] const std::vector<Duties>& duties() const { return duties_; }
  /// Per known body, 1: it moves by itself.
  [[nodiscard]] const std::vector<std::uint8_t>& driven() const { return driven_; }
  [[nodiscard]] const DriveModel& drive() const { return drive_; }
  /// Drives, to which known bodies were added, with the model's effects and all that follows; exact for those within reach.
  void complete(Tick from, Drives&);

  // At the present tick.
  [[nodiscard]] Tick tick() const { return tick_; }
  [[nodiscard]] const Bodies& listed() const { return listed_; }
  [[nodiscard]] const std::vector<PartitionId>& neighbours() const { return neighbours_; }
  void emit_bodies(BodyFrame&) const;
  void emit_ghosts(PartitionId neighbour, BodyFrame&) const;
  /// How far from a neighbour's rectangle robots are ghosts there, mm.
  [[nodiscard]] double ghost_margin_mm() const { return margin_mm_; }
  /// Adds a listed robot to a frame of ghosts.
  void add_ghost(std::size_t listed, BodyFrame&) const;
  [[nodiscard]] std::uint64_t hash_part() const;
  void save(proto::PhysicsState&) const;
  void load(Tick, std::span<const proto::PhysicsState* const> parts);

 private:
  void take_tracked(std::span<const TrackedPoseInput>);
  void gather(std::span<const BodyFrame* const> ghosts);
  void read_motors(Tick from, std::span<const ActuationFrame* const>);
  [[nodiscard]] bool is_own(double x_mm, double y_mm) const { return rectangle_.contains(x_mm, y_mm); }
  /// The known bodies at the start of the step.
  [[nodiscard]] RobotColumns known_columns() const;
  void remember();

  DriveModel drive_;
  EffectMemory memory_;
  ArenaFields fields_;
  PartitionGrid grid_;
  Rectangle rectangle_;
  double margin_mm_;
  std::uint32_t robots_;
  std::vector<std::uint8_t> is_tracked_;  ///< per robot; empty where there is none
  std::vector<PartitionId> neighbours_;

  Tick tick_;
  Bodies listed_;
  Bodies tracked_;  ///< all tracked robots, wherever they are

  // Within a step.
  Bodies known_, previous_;        ///< of the present step and of the one before
  std::vector<std::uint8_t> own_;  ///< per known body, by its pose before the step; empty with one partition
  Merge merge_;
  std::vector<const ActuationFrame*> frames_;
  std::vector<Duties> duties_;        ///< per known body
  std::vector<std::uint8_t> driven_;  ///< per known body
  std::vector<double> x_mm_, y_mm_,
      heading_rad_;  ///< per known body, before the step, where something is remembered
};

/// An engine over a population; what is left to do is to move it.
class PopulationEngine : public Engine {
 public:
  void step(Tick from, const Inputs& inputs) final {
    population_.begin(from, inputs);
    move(from, inputs);
    population_.end();
  }
  void emit_bodies(BodyFrame& frame) const override { population_.emit_bodies(frame); }
  void emit_ghosts(PartitionId neighbour, BodyFrame& frame) const override {
    population_.emit_ghosts(neighbour, frame);
  }
  [[nodiscard]] const std::vector<PartitionId>& neighbours() const override { return population_.neighbours(); }
  [[nodiscard]] std::uint64_t hash_part() const override { return population_.hash_part(); }
  void save(proto::PhysicsState& state) const override { population_.save(state); }
  void load(Tick tick, std::span<const proto::PhysicsState* const> parts) override {
    population_.load(tick, parts);
  }

 protected:
  /// `reach_mm`: as Population takes it.
  PopulationEngine(const RunPlan& plan, PartitionId partition, DriveModel drive, double reach_mm)
      : population_(plan, partition, std::move(drive), reach_mm) {}
  /// From tick `from` to the next: own bodies get their new poses; those of others may be left as they are.
  virtual void move(Tick from, const Inputs&) = 0;

  Population population_;
};

}  // namespace kilotwin::physics

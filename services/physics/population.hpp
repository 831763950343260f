/// The bodies that one partition knows, and the tasks that all engines share: ownership, ghosts for neighbours, hashing,
/// saving and loading. An engine moves the bodies.
///
///   begin(k): known = bodies listed at k + ghosts of k + present tracked robots, within the margin of the rectangle
///             own   = known bodies whose pose at k lies in the rectangle
///   (the engine moves the own bodies among the known from k to k+1)
///   end():    listed at k+1 = own, and absent tracked robots where they were last; what the model's effects remember
///
/// A tracked robot that is absent has no body: it is listed, so that every robot has a pose, and known to no engine. So is a cell
/// of a Kilogrid.
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
  /// `reach_mm`: largest distance from the rectangle at which a robot can affect own ones within a tick, without effects.
  Population(const RunPlan&, PartitionId, DriveModel, double reach_mm);

  /// Distance from the rectangle within which robots must be known, mm. It exceeds `reach_mm` if effects read neighbours or
  /// fields.
  [[nodiscard]] static double margin_mm(const RunPlan&, const DriveModel&, double reach_mm);

  /// Applies tracked poses, gathers the known bodies and reads their motors. `from` must be the current tick.
  void begin(Tick from, const Inputs&);
  /// Advances the current tick by one.
  void end();
  /// Lists robots that were placed elsewhere where they are now; after end().
  void relocate(std::span<const Relocation>);

  // Valid between begin() and end(); ascending ids.
  [[nodiscard]] Bodies& known() { return known_; }
  [[nodiscard]] const Bodies& known() const { return known_; }
  /// Per known body, whether the partition owns it; empty: all of them.
  [[nodiscard]] const std::vector<std::uint8_t>& own() const { return own_; }
  /// Per known body; 0 for tracked robots and robots in no frame.
  [[nodiscard]] const std::vector<Duties>& duties() const { return duties_; }
  /// Per known body, 1: its drive moves it.
  [[nodiscard]] const std::vector<std::uint8_t>& driven() const { return driven_; }
  [[nodiscard]] const DriveModel& drive() const { return drive_; }
  /// Applies the model's effects to drives of known bodies, and integrates them. Exact for bodies within `reach_mm`.
  void complete(Tick from, Drives&);

  // At the current tick.
  [[nodiscard]] Tick tick() const { return tick_; }
  [[nodiscard]] std::uint32_t bodies_without_space() const { return without_space_; }
  [[nodiscard]] const Bodies& listed() const { return listed_; }
  [[nodiscard]] const std::vector<PartitionId>& neighbours() const { return neighbours_; }
  void emit_bodies(BodyFrame&) const;
  void emit_ghosts(PartitionId neighbour, BodyFrame&) const;
  /// Distance from a neighbour's rectangle within which this partition's robots are ghosts there, mm.
  [[nodiscard]] double ghost_margin_mm() const { return margin_mm_; }
  /// Adds a listed robot to a frame of ghosts.
  void add_ghost(std::size_t listed, BodyFrame&) const;
  [[nodiscard]] std::uint64_t hash_part() const;
  void save(proto::PhysicsState&) const;
  void load(Tick, std::span<const proto::PhysicsState* const> parts);

 private:
  void take_tracked(const Inputs&);
  void count_without_space();
  void list_absent();
  void gather(std::span<const BodyFrame* const> ghosts);
  void read_motors(Tick from, std::span<const ActuationFrame* const>);
  [[nodiscard]] bool is_own(double x_mm, double y_mm) const { return rectangle_.contains(x_mm, y_mm); }
  /// The known bodies at the start of the step, as columns for the effects.
  [[nodiscard]] RobotColumns known_columns() const;
  void remember();

  DriveModel drive_;
  EffectMemory memory_;
  ArenaFields fields_;
  PartitionGrid grid_;
  Rectangle rectangle_;
  double margin_mm_;
  std::uint32_t robots_;
  std::vector<std::uint8_t> is_tracked_;  ///< per robot; empty if no robot is tracked
  std::vector<PartitionId> neighbours_;

  Tick tick_;
  Bodies listed_;
  Bodies tracked_;                      ///< all tracked robots, wherever they are
  std::vector<std::uint8_t> absent_;    ///< per entry of tracked_
  std::vector<std::uint8_t> on_other_;  ///< per entry of tracked_, 1: it stood on another body after the last step
  std::uint32_t without_space_ = 0;
  Bodies absentees_;                   ///< own absent bodies, of tracked_
  bool absentees_are_listed_ = false;  ///< absentees_ is up to date

  // Within a step.
  Bodies known_, previous_;        ///< of the current step and of the one before
  Bodies merged_;                  ///< scratch of list_absent()
  std::vector<std::uint8_t> own_;  ///< per known body, by its pose before the step; empty with one partition
  Merge merge_;
  std::vector<const ActuationFrame*> frames_;
  std::vector<Duties> duties_;        ///< per known body
  std::vector<std::uint8_t> driven_;  ///< per known body
  std::vector<double> x_mm_, y_mm_,
      heading_rad_;  ///< per known body, before the step; filled if effects have memory
};

/// Base class of engines over a population: a derived class only moves the bodies.
class PopulationEngine : public Engine {
 public:
  void step(Tick from, const Inputs& inputs) final {
    population_.begin(from, inputs);
    move(from, inputs);
    population_.end();
    if (inputs.relocations.empty()) return;
    population_.relocate(inputs.relocations);
    for (const Relocation& relocation : inputs.relocations) relocated(relocation);
  }
  void emit_bodies(BodyFrame& frame) const override { population_.emit_bodies(frame); }
  void emit_ghosts(PartitionId neighbour, BodyFrame& frame) const override {
    population_.emit_ghosts(neighbour, frame);
  }
  [[nodiscard]] const std::vector<PartitionId>& neighbours() const override { return population_.neighbours(); }
  [[nodiscard]] std::uint32_t bodies_without_space() const override { return population_.bodies_without_space(); }
  [[nodiscard]] std::uint64_t hash_part() const override { return population_.hash_part(); }
  void save(proto::PhysicsState& state) const override { population_.save(state); }
  void load(Tick tick, std::span<const proto::PhysicsState* const> parts) override {
    population_.load(tick, parts);
  }

 protected:
  /// `reach_mm`: as for Population.
  PopulationEngine(const RunPlan& plan, PartitionId partition, DriveModel drive, double reach_mm)
      : population_(plan, partition, std::move(drive), reach_mm) {}
  /// Moves own bodies from tick `from` to the next. It may leave other bodies' poses unchanged.
  virtual void move(Tick from, const Inputs&) = 0;
  /// Sets what the engine knows of a body that was placed elsewhere, besides its pose in the population: it stands still and
  /// touches nothing. Called for all bodies, whichever partition has them.
  virtual void relocated(const Relocation&) {}

  Population population_;
};

}  // namespace kilotwin::physics

/// The ODE engine: rigid bodies in space, solved by the Open Dynamics Engine. A robot is an upright cylinder on three legs; it
/// has mass, stands by its weight, and drives by friction at its rear legs, whose force is bounded. The floor may be tilted.
///
///   move from tick k: groups : known robots that can touch each other within the tick, by chains
///                     a group without own robots is left out; one in which nobody is driven and all rest, stays
///                     S sub-steps of each group: touch points, then ODE's solver
/// Contacts: legs on the floor; between cylinders, at half height, without friction; of cylinders at walls, the same.
///
/// State is in RigidState alone: ODE's world is filled for each group and emptied after it, always in ascending ids. A
/// group's next state is a function of its robots, their motors and the seed: the same in any mode, thread, process and
/// machine with the same libode, and after a checkpoint. Neighbours' robots within the margin are simulated along with the
/// own ones, so a group comes out the same in any partition that knows all of it. One that reaches farther than
/// kReachHops - 1 robots beyond the border is cut there, and the ghosts behind the cut go on at their velocities: over
/// partition grids, and for such groups alone, results are alike, not the same.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/random/random.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/ode_world.hpp"
#include "services/physics/population.hpp"

namespace kilotwin::physics {

/// Height of a robot with its legs, mm (Rubenstein, Ahler and Nagpal, ICRA 2012; K-Team's data sheet).
inline constexpr double kRobotHeight_mm = 34;
/// How many robots deep a partition sees into its neighbours.
inline constexpr double kReachHops = 4;

/// What is fixed for a run.
struct OdeLimits {
  OdeLimits(const RunPlan&, const DriveModel&);

  std::uint32_t sub_steps;
  double sub_step_s;
  double top_speed_mm_s;  ///< nobody is faster: driven, parting, or sliding down the whole arena
  double reach_mm;        ///< two gaps wider than this do not close within a tick
  double rim_mm;          ///< ghosts farther than this from the rectangle may touch others that are not known
  double margin_mm;       ///< of ghosts
  double x_limit_mm, y_limit_mm;  ///< the centre of a robot stays within +-limit

  [[nodiscard]] bool outside(double x_mm, double y_mm) const;
};

class OdeEngine final : public PopulationEngine {
 public:
  /// Throws UserError where the experiment asks for what the engine cannot do.
  OdeEngine(const RunPlan&, PartitionId);

  void emit_ghosts(PartitionId neighbour, BodyFrame&) const override;
  void save(proto::PhysicsState&) const override;
  void load(Tick, std::span<const proto::PhysicsState* const> parts) override;

 private:
  OdeEngine(const RunPlan&, PartitionId, const DriveModel&);

  void move(Tick from, const Inputs&) override;
  void read_ghosts(const Inputs&);
  void set_off(Tick from);
  void make_groups();
  [[nodiscard]] bool rests(std::span<const std::uint32_t> group) const;
  void step_group(Tick from, std::span<const std::uint32_t> group);
  [[nodiscard]] bool step_group(Tick from, std::span<const std::uint32_t> group, Solver);
  void touch_floor(std::uint32_t body);
  void touch_walls(std::uint32_t body);
  void touch_others(std::uint32_t body, double since_s);
  [[nodiscard]] RigidState upright(double x_mm, double y_mm, double heading_rad) const;
  /// Neither walls nor others are within reach.
  [[nodiscard]] bool stands_free(std::uint32_t body) const;

  Rectangle rectangle_;
  OdeLimits limits_;
  Random random_;
  Inertia inertia_;
  double rest_grip_;                ///< coefficient of friction of resting legs
  double thrust_g_mm_s2_;           ///< the force of a driven robot at most
  std::array<Vector3, 3> legs_mm_;  ///< tips, in the body's frame: rear left, rear right, front
  Vector3 downhill_;                ///< unit; 0 on a level floor
  bool holds_on_slope_;             ///< a robot at rest stays so
  OdeWorld world_;
  CandidateList candidates_;
  std::vector<RigidState> states_;  ///< per robot; of those that are listed, current

  // Within a step; per known body.
  Drives drives_;
  std::vector<std::uint32_t> drive_of_, leader_, in_world_;
  /// 1: it is not simulated: where a tracker says, or a ghost at the rim, which moves on as it does.
  std::vector<std::uint8_t> stands_;
  std::vector<RigidState> now_;
  std::vector<Vector3> start_axis_;               ///< where a body looked at the tick's start, level
  std::vector<std::uint32_t> order_, group_end_;  ///< bodies sorted by group
};

}  // namespace kilotwin::physics

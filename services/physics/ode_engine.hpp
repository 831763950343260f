/// The ODE engine: rigid bodies in space, solved by the Open Dynamics Engine. A robot is an upright cylinder on three legs,
/// with mass and weight. It drives by friction at its rear legs, with limited force. Movable bodies are upright prisms that
/// stand on their corners. The floor may be tilted.
///
///   move from tick k: group the known bodies that can touch each other within the tick, directly or through others
///                     skip groups without own bodies; leave groups at rest without driven bodies unchanged
///                     per other group, S sub-steps: find touch points (ode_touch.cpp), then call ODE's solver
/// Contacts with bodies, obstacles and walls have no friction and act at half the height of the lower body. They are found
/// in the plane, as for upright bodies.
///
/// All state is in RigidState: ODE's world is filled for each group in ascending ids, and emptied afterwards. A group's next
/// state is a function of its bodies, their motors and the seed. It is the same in any mode, thread, process and machine
/// with the same libode, and after a checkpoint. All partitions know all movable bodies. A partition also simulates
/// neighbours' robots within the margin, or beside a movable body that it reaches. So every partition that knows a whole
/// group computes the same result. A group that reaches farther than kReachHops - 1 robots across a border is cut there, and
/// the ghosts behind the cut keep their velocities. For such groups alone, results differ slightly between partition grids.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/plan/world.hpp"
#include "core/random/random.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/ode_world.hpp"
#include "services/physics/population.hpp"

namespace kilotwin::physics {

/// Height of a robot with its legs, mm (Rubenstein, Ahler and Nagpal, ICRA 2012; K-Team's data sheet).
inline constexpr double kRobotHeight_mm = 34;
/// Depth in robots to which a partition knows its neighbours' bodies.
inline constexpr double kReachHops = 4;

/// Constants of a run.
struct OdeLimits {
  OdeLimits(const RunPlan&, const DriveModel&);

  std::uint32_t sub_steps;
  double sub_step_s;
  double top_speed_mm_s;  ///< upper bound of any speed: driven, separating, or sliding down the whole arena
  double reach_mm;        ///< gaps wider than this do not close within a tick
  double rim_mm;          ///< ghosts farther than this from the computed region may touch unknown bodies
  double margin_mm;       ///< width of the border in which bodies are ghosts
};

class OdeEngine final : public PopulationEngine {
 public:
  OdeEngine(const RunPlan&, PartitionId);

  void emit_bodies(BodyFrame&) const override;
  void emit_ghosts(PartitionId neighbour, BodyFrame&) const override;
  [[nodiscard]] std::uint64_t hash_part() const override;
  void save(proto::PhysicsState&) const override;
  void load(Tick, std::span<const proto::PhysicsState* const> parts) override;

 private:
  /// Constant properties of a robot or a movable body; all robots have the same.
  struct Kind {
    Convex shape;
    Inertia inertia{};
    double height_mm = 0, friction = 0;
    bool holds_on_slope = false;  ///< at rest, it does not slide down the tilted floor
  };

  OdeEngine(const RunPlan&, PartitionId, const DriveModel&);

  void move(Tick from, const Inputs&) override;
  void relocated(const Relocation&) override;
  void read_ghosts(const Inputs&);
  void place_bodies();
  void fill_drives(Tick from);
  void find_near();
  void make_groups();
  [[nodiscard]] bool rests(std::span<const std::uint32_t> group) const;
  [[nodiscard]] bool stands_free(std::uint32_t body) const;
  void step_group(Tick from, std::span<const std::uint32_t> group);
  [[nodiscard]] bool step_group(Tick from, std::span<const std::uint32_t> group, Solver);
  void keep(std::uint32_t body);

  void touch_floor(std::uint32_t body);
  void touch_floor_driven(TouchPoint&, std::uint32_t body, const Vector3& ahead, std::uint32_t drive);
  void touch_walls(std::uint32_t body);
  void touch_wall(std::uint32_t body, Point2 at, double radius_mm);
  void touch_obstacles(std::uint32_t body);
  void touch_robots(std::uint32_t body, double since_s);
  void touch_pair(std::uint32_t body, std::uint32_t other, double since_s);
  void touch_shapes(TouchPoint&, const Convex& body, const Place& here, const Convex& other, const Place& there);
  void add_touch(TouchPoint&, double x_mm, double y_mm, double normal_x, double normal_y, double gap_mm);

  [[nodiscard]] bool is_robot(std::uint32_t body) const { return body < population_.known().size(); }
  [[nodiscard]] std::uint32_t movable_of(std::uint32_t body) const {
    return body - static_cast<std::uint32_t>(population_.known().size());
  }
  [[nodiscard]] const Kind& kind(std::uint32_t body) const {
    return is_robot(body) ? robot_ : movable_[movable_of(body)];
  }
  [[nodiscard]] bool is_own(std::uint32_t body) const;
  [[nodiscard]] Place place(std::uint32_t body) const;
  [[nodiscard]] double distance_mm(const Rectangle&, double x_mm, double y_mm) const;
  [[nodiscard]] static RigidState upright(double x_mm, double y_mm, double heading_rad, double height_mm);
  void add_movables(BodyFrame&) const;
  void list_movables();

  PartitionGrid grid_;
  Rectangle rectangle_;
  OdeLimits limits_;
  Random random_;
  const World scene_;
  Kind robot_;
  std::vector<Kind> movable_;
  double thrust_g_mm_s2_;           ///< largest force of a driven robot
  std::array<Vector3, 3> legs_mm_;  ///< tips, in the body's frame: rear left, rear right, front
  Vector3 downhill_;                ///< unit
  OdeWorld world_;
  CandidateList candidates_;
  std::vector<std::uint8_t> immobile_;  ///< per robot
  std::vector<RigidState> states_;      ///< per robot; current for listed robots
  std::vector<RigidState>
      movable_states_;  ///< per movable body; current for listed ones, a tick old for the others
  std::vector<std::uint8_t> listed_movable_, own_movable_;

  // Within a step; per body: known robots, then all movable bodies.
  Drives drives_;
  static constexpr std::uint32_t kUndriven = 0xffffffff;  ///< in drive_of_
  std::vector<std::uint32_t> drive_of_, leader_, in_world_;
  /// 1: the body is not simulated: immobile, tracked, or a ghost at the rim, which keeps its velocity.
  std::vector<std::uint8_t> not_simulated_;
  std::vector<RigidState> now_;
  std::vector<Vector3> start_axis_;  ///< horizontal direction of the heading at the tick's start
  std::vector<std::pair<std::uint32_t, std::uint32_t>> near_;  ///< (body, movable body) within reach, ascending
  std::vector<std::uint32_t> order_, group_end_;  ///< bodies sorted by group, and the end of each group
};

/// The unit vector along (x, y); `fallback` if both are 0.
[[nodiscard]] inline Vector3 level(double x, double y, const Vector3& fallback) {
  const double length = __builtin_sqrt(x * x + y * y);
  if (!(length > 0)) return fallback;
  return {x / length, y / length, 0};
}

/// A body's axes in the arena's frame.
struct Axes {
  Vector3 x, y, z;

  explicit Axes(const std::array<double, 4>& q) {
    const double w = q[0], i = q[1], j = q[2], k = q[3];
    x = {1 - 2 * (j * j + k * k), 2 * (i * j + w * k), 2 * (i * k - w * j)};
    y = {2 * (i * j - w * k), 1 - 2 * (i * i + k * k), 2 * (j * k + w * i)};
    z = {2 * (i * k + w * j), 2 * (j * k - w * i), 1 - 2 * (i * i + j * j)};
  }
  [[nodiscard]] Vector3 to_arena(const Vector3& v) const {
    return {x[0] * v[0] + y[0] * v[1] + z[0] * v[2], x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
            x[2] * v[0] + y[2] * v[1] + z[2] * v[2]};
  }
};

}  // namespace kilotwin::physics

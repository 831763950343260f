#include "services/physics/ode_engine.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "core/plan/motion_settings.hpp"
#include "core/plan/physics_settings.hpp"
#include "idl/checkpoint.pb.h"
#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

constexpr double kGravity_mm_s2 = 9806.65;
/// An undriven robot below both values is at rest; its velocity is set to 0.
constexpr double kRestSpeed_mm_s = 0.01, kRestSpin_rad_s = 0.001;
/// Bodies at rest may overlap by this much: rounding, and the solver's softness.
constexpr double kRestOverlap_mm = 0.001;
constexpr double kNewton_g_mm_s2 = 1e6;

double square_of(const Vector3& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// Writes a state into columns and returns the position after it.
double* pack(const RigidState& state, double* columns) {
  *columns++ = state.position_mm[2];
  columns = std::copy(state.rotation.begin(), state.rotation.end(), columns);
  columns = std::copy(state.velocity_mm_s.begin(), state.velocity_mm_s.end(), columns);
  return std::copy(state.spin_rad_s.begin(), state.spin_rad_s.end(), columns);
}

double heading_of(const RigidState& state) {
  const Axes axes(state.rotation);
  return wrapped(kt_atan2(axes.x[1], axes.x[0]));
}

RigidState unpacked(double x_mm, double y_mm, const double* columns) {
  RigidState state;
  state.position_mm = {x_mm, y_mm, columns[0]};
  std::copy_n(columns + 1, 4, state.rotation.begin());
  std::copy_n(columns + 5, 3, state.velocity_mm_s.begin());
  std::copy_n(columns + 8, 3, state.spin_rad_s.begin());
  return state;
}

Vector3 downhill_of(const PhysicsSettings& physics) {
  double sine, cosine;
  kt_sincos(physics.downhill_deg * (kPi / 180), &sine, &cosine);
  return {cosine, sine, 0};
}

Vector3 gravity_of(const PhysicsSettings& physics) {
  double sine, cosine;
  kt_sincos(physics.tilt_deg * (kPi / 180), &sine, &cosine);
  const Vector3 downhill = downhill_of(physics);
  return {kGravity_mm_s2 * sine * downhill[0], kGravity_mm_s2 * sine * downhill[1], -kGravity_mm_s2 * cosine};
}

/// Whether a body at rest stays at rest on the tilted floor.
bool holds(const PhysicsSettings& physics, double grip) {
  double sine, cosine;
  kt_sincos(physics.tilt_deg * (kPi / 180), &sine, &cosine);
  return sine < grip * cosine;
}

}  // namespace

OdeLimits::OdeLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.physics_settings().sub_steps, 1u, 4u)) {
  const double tick_s = plan.tick_length.seconds();
  const double width_mm = 2 * plan.world.arena.half_width_mm(), height_mm = 2 * plan.world.arena.half_height_mm();
  sub_step_s = tick_s / sub_steps;
  const Vector3 gravity = gravity_of(plan.physics_settings());
  const double along_mm_s2 = __builtin_sqrt(gravity[0] * gravity[0] + gravity[1] * gravity[1]);
  const double diagonal_mm = __builtin_sqrt(width_mm * width_mm + height_mm * height_mm);
  top_speed_mm_s =
      std::max(kSeparation_mm_s, drive.top_speed_mm_s()) + __builtin_sqrt(2 * along_mm_s2 * diagonal_mm);
  const double stride_mm = top_speed_mm_s * tick_s;
  reach_mm = 2 * stride_mm;
  const double hop_mm = 2 * kRobotRadius_mm + reach_mm;
  rim_mm = (kReachHops - 1) * hop_mm;
  margin_mm = kReachHops * hop_mm + stride_mm;
}

OdeEngine::OdeEngine(const RunPlan& plan, PartitionId partition) : OdeEngine(plan, partition, DriveModel(plan)) {}

OdeEngine::OdeEngine(const RunPlan& plan, PartitionId partition, const DriveModel& drive)
    : PopulationEngine(plan, partition, drive, OdeLimits(plan, drive).margin_mm),
      grid_(plan.grid),
      rectangle_(plan.grid.rectangle(partition)),
      limits_(plan, drive),
      random_(plan.seed()),
      scene_(plan.world),
      thrust_g_mm_s2_(plan.physics_settings().thrust_N * kNewton_g_mm_s2),
      downhill_(downhill_of(plan.physics_settings())),
      world_(gravity_of(plan.physics_settings()), limits_.sub_step_s),
      candidates_(2 * kRobotRadius_mm + limits_.reach_mm),
      states_(plan.robots()) {
  const PhysicsSettings& physics = plan.physics_settings();
  const MotionSettings& motion = plan.motion_settings();
  const double half_base_mm = motion.wheel_base_mm / 2;
  legs_mm_ = {{{-motion.axle_offset_mm, half_base_mm, -kRobotHeight_mm / 2},
               {-motion.axle_offset_mm, -half_base_mm, -kRobotHeight_mm / 2},
               {kRobotRadius_mm, 0, -kRobotHeight_mm / 2}}};
  const auto make_kind = [&](const Convex& shape, double mass_g, double height_mm, double friction) {
    return Kind{shape, Inertia::prism(mass_g, shape, height_mm), height_mm, friction, holds(physics, friction)};
  };
  robot_ = make_kind(Convex::disc(kRobotRadius_mm), physics.robot_mass_g, kRobotHeight_mm, physics.robot_friction);
  immobile_.resize(plan.robots());
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) immobile_[robot] = plan.immobile(robot);
  for (const MovableBodyModel& body : scene_.movables) {
    movable_.push_back(make_kind(body.shape, 1000 * body.mass_kg, body.height_mm, body.friction));
    movable_states_.push_back(upright(body.pose.x_mm, body.pose.y_mm, body.pose.heading_rad, body.height_mm));
  }
  own_movable_.resize(movable_.size());
  list_movables();
  const Bodies& listed = population_.listed();
  for (std::size_t i = 0; i < listed.size(); ++i)
    states_[listed.robot[i]] = upright(listed.x_mm[i], listed.y_mm[i], listed.heading_rad[i], kRobotHeight_mm);
}

RigidState OdeEngine::upright(double x_mm, double y_mm, double heading_rad, double height_mm) {
  RigidState state;
  state.position_mm = {x_mm, y_mm, height_mm / 2};
  double sine, cosine;
  kt_sincos(heading_rad / 2, &sine, &cosine);
  state.rotation = {cosine, 0, 0, sine};
  return state;
}

void OdeEngine::list_movables() {
  listed_movable_.resize(movable_.size());
  for (std::size_t m = 0; m < movable_.size(); ++m)
    listed_movable_[m] = rectangle_.contains(movable_states_[m].position_mm[0], movable_states_[m].position_mm[1]);
}

Place OdeEngine::place(std::uint32_t i) const {
  const Axes axes(now_[i].rotation);
  const Vector3 ahead = level(axes.x[0], axes.x[1], {1, 0, 0});
  return {now_[i].position_mm[0], now_[i].position_mm[1], ahead[0], ahead[1]};
}

bool OdeEngine::is_own(std::uint32_t i) const {
  if (!is_robot(i)) return own_movable_[movable_of(i)] != 0;
  return population_.own().empty() || population_.own()[i] != 0;
}

/// Distance of a point from the region that a partition computes: its rectangle and the movable bodies that it reaches.
double OdeEngine::distance_mm(const Rectangle& rectangle, double x_mm, double y_mm) const {
  double least_mm = rectangle.distance_mm(x_mm, y_mm);
  for (std::size_t m = 0; m < movable_.size(); ++m) {
    const double at_x = movable_states_[m].position_mm[0], at_y = movable_states_[m].position_mm[1];
    const double reach_mm = movable_[m].shape.reach_mm();
    if (rectangle.distance_mm(at_x, at_y) > reach_mm + limits_.margin_mm) continue;
    const double dx = x_mm - at_x, dy = y_mm - at_y;
    least_mm = std::min(least_mm, __builtin_sqrt(dx * dx + dy * dy) - reach_mm);
  }
  return least_mm;
}

void OdeEngine::move(Tick from, const Inputs& inputs) {
  read_ghosts(inputs);
  place_bodies();
  fill_drives(from);
  candidates_.update(population_.known());
  find_near();
  make_groups();
  std::uint32_t first = 0;
  for (const std::uint32_t end : group_end_) {
    const std::span<const std::uint32_t> group(order_.data() + first, order_.data() + end);
    first = end;
    if (not_simulated_[group[0]] != 0) continue;  // Such bodies form groups of one.
    if (std::none_of(group.begin(), group.end(), [this](std::uint32_t i) { return is_own(i); })) continue;
    if (rests(group)) {
      for (const std::uint32_t i : group) now_[i].velocity_mm_s = now_[i].spin_rad_s = {};
    } else {
      step_group(from, group);
    }
    for (const std::uint32_t i : group) {
      if (is_own(i)) keep(i);
    }
  }
}

void OdeEngine::relocated(const Relocation& relocation) {
  const auto& [movable, body, pose] = relocation;
  RigidState& state = movable ? movable_states_[body] : states_[body];
  state = upright(pose.x_mm, pose.y_mm, pose.heading_rad, movable ? movable_[body].height_mm : kRobotHeight_mm);
  if (movable) list_movables();
}

void OdeEngine::read_ghosts(const Inputs& inputs) {
  for (const BodyFrame* frame : inputs.ghosts) {
    const std::vector<std::uint32_t>& movables = frame->movable.body;
    KILOTWIN_DEMAND(frame->spatial.size() == (frame->robot.size() + movables.size()) * BodyFrame::kSpatialColumns);
    const double* columns = frame->spatial.data();
    for (std::size_t g = 0; g < frame->robot.size(); ++g, columns += BodyFrame::kSpatialColumns)
      states_[frame->robot[g]] = unpacked(frame->x_mm[g], frame->y_mm[g], columns);
    for (std::size_t g = 0; g < movables.size(); ++g, columns += BodyFrame::kSpatialColumns)
      movable_states_[movables[g]] = unpacked(frame->movable.x_mm[g], frame->movable.y_mm[g], columns);
  }
  for (std::size_t m = 0; m < movable_.size(); ++m)
    own_movable_[m] = rectangle_.contains(movable_states_[m].position_mm[0], movable_states_[m].position_mm[1]);
  listed_movable_ = own_movable_;
}

void OdeEngine::place_bodies() {
  const Bodies& known = population_.known();
  const std::size_t count = known.size() + movable_.size();
  now_.resize(count);
  not_simulated_.resize(count);
  in_world_.resize(count);
  start_axis_.resize(count);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const double x = known.x_mm[i], y = known.y_mm[i];
    now_[i] =
        known.tracked[i] != 0 ? upright(x, y, known.heading_rad[i], kRobotHeight_mm) : states_[known.robot[i]];
    not_simulated_[i] = known.tracked[i] != 0 || immobile_[known.robot[i]] != 0 ||
                        (grid_.size() > 1 && distance_mm(rectangle_, x, y) > limits_.rim_mm);
  }
  for (std::size_t m = 0; m < movable_.size(); ++m) {
    const RigidState& state = movable_states_[m];
    now_[known.size() + m] = state;
    not_simulated_[known.size() + m] = rectangle_.distance_mm(state.position_mm[0], state.position_mm[1]) >
                                       movable_[m].shape.reach_mm() + limits_.margin_mm;
  }
}

void OdeEngine::fill_drives(Tick from) {
  const Bodies& known = population_.known();
  const std::vector<Duties>& duties = population_.duties();
  const std::vector<std::uint8_t>& driven = population_.driven();
  drives_.reserve(known.size());
  drives_.count = 0;
  drive_of_.assign(now_.size(), kUndriven);
  for (std::uint32_t i = 0; i < known.size(); ++i) {
    if (driven[i] == 0 || not_simulated_[i] != 0) continue;
    drive_of_[i] = static_cast<std::uint32_t>(drives_.count);
    population_.drive().add(drives_, i, known.robot[i], from, duties[i], known.heading_rad[i],
                            1.0 / limits_.sub_steps);
  }
  population_.complete(from, drives_);
}

void OdeEngine::find_near() {
  near_.clear();
  const auto robots = static_cast<std::uint32_t>(population_.known().size());
  for (std::uint32_t m = robots; m < now_.size(); ++m) {
    const Vector3& at = now_[m].position_mm;
    for (std::uint32_t i = 0; i < m; ++i) {
      if (not_simulated_[i] != 0 && not_simulated_[m] != 0) continue;
      const double dx = now_[i].position_mm[0] - at[0], dy = now_[i].position_mm[1] - at[1];
      const double near_mm = kind(i).shape.reach_mm() + kind(m).shape.reach_mm() + limits_.reach_mm;
      if (dx * dx + dy * dy > near_mm * near_mm) continue;
      if (separation_mm(kind(i).shape, place(i), kind(m).shape, place(m)) <= limits_.reach_mm)
        near_.emplace_back(i, m);
    }
  }
}

void OdeEngine::make_groups() {
  const Bodies& known = population_.known();
  const auto count = static_cast<std::uint32_t>(now_.size());
  const double reach_mm = 2 * kRobotRadius_mm + limits_.reach_mm, reach_square_mm2 = reach_mm * reach_mm;
  // The leader of a group is its lowest body: union-find with path halving.
  leader_.resize(count);
  const auto leader = [this](std::uint32_t i) {
    while (leader_[i] != i) i = leader_[i] = leader_[leader_[i]];
    return i;
  };
  const auto unite = [&](std::uint32_t i, std::uint32_t j) {
    const std::uint32_t a = leader(i), b = leader(j);
    leader_[std::max(a, b)] = std::min(a, b);
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    leader_[i] = i;
    if (not_simulated_[i] != 0 || !is_robot(i)) continue;
    for (const std::uint32_t j : candidates_.of(i)) {
      if (j >= i) break;
      const double dx = known.x_mm[i] - known.x_mm[j], dy = known.y_mm[i] - known.y_mm[j];
      if (not_simulated_[j] == 0 && dx * dx + dy * dy <= reach_square_mm2) unite(i, j);
    }
  }
  for (const auto& [i, m] : near_) {
    if (not_simulated_[i] == 0 && not_simulated_[m] == 0) unite(i, m);
  }
  // Counting sort by leader; ascending within a group.
  group_end_.assign(count + 1, 0);
  for (std::uint32_t i = 0; i < count; ++i) ++group_end_[(leader_[i] = leader(i)) + 1];
  for (std::uint32_t i = 0; i < count; ++i) group_end_[i + 1] += group_end_[i];
  order_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) order_[group_end_[leader_[i]]++] = i;
  group_end_.pop_back();
  group_end_.erase(std::unique(group_end_.begin(), group_end_.end()), group_end_.end());
  if (!group_end_.empty() && group_end_.front() == 0) group_end_.erase(group_end_.begin());
}

bool OdeEngine::stands_free(std::uint32_t i) const {
  const Bodies& known = population_.known();
  const double x = known.x_mm[i], y = known.y_mm[i], near_mm = 2 * kRobotRadius_mm + limits_.reach_mm;
  if (scene_.arena.clearance_mm({x, y}) < kRobotRadius_mm + limits_.reach_mm) return false;
  for (const ObstacleBody& obstacle : scene_.obstacles) {
    if (obstacle.shape.nearest(obstacle.place, {x, y}).distance_mm < kRobotRadius_mm + limits_.reach_mm)
      return false;
  }
  if (std::any_of(near_.begin(), near_.end(), [i](const auto& pair) { return pair.first == i; })) return false;
  for (const std::uint32_t j : candidates_.of(i)) {
    const double dx = known.x_mm[j] - x, dy = known.y_mm[j] - y;
    if (dx * dx + dy * dy <= near_mm * near_mm) return false;
  }
  return true;
}

bool OdeEngine::rests(std::span<const std::uint32_t> group) const {
  const Bodies& known = population_.known();
  for (const std::uint32_t i : group) {
    const RigidState& state = now_[i];
    if (!kind(i).holds_on_slope || drive_of_[i] != kUndriven ||
        square_of(state.velocity_mm_s) > kRestSpeed_mm_s * kRestSpeed_mm_s ||
        square_of(state.spin_rad_s) > kRestSpin_rad_s * kRestSpin_rad_s ||
        scene_.arena.clearance_mm(kind(i).shape, place(i)) < -kRestOverlap_mm) {
      return false;
    }
    if (!is_robot(i)) continue;
    constexpr double kNear_mm = 2 * kRobotRadius_mm - kRestOverlap_mm;
    for (const std::uint32_t j : candidates_.of(i)) {
      const double dx = known.x_mm[i] - known.x_mm[j], dy = known.y_mm[i] - known.y_mm[j];
      if (dx * dx + dy * dy < kNear_mm * kNear_mm) return false;
    }
  }
  // A tracked robot or a ghost at the rim may move towards a body of the group, or overlap a movable body.
  return std::none_of(near_.begin(), near_.end(), [&](const auto& pair) {
    const bool first = std::binary_search(group.begin(), group.end(), pair.first),
               second = std::binary_search(group.begin(), group.end(), pair.second);
    return (first || second) && separation_mm(kind(pair.first).shape, place(pair.first), kind(pair.second).shape,
                                              place(pair.second)) < -kRestOverlap_mm;
  });
}

void OdeEngine::step_group(Tick from, std::span<const std::uint32_t> group) {
  const std::uint32_t first = group[0];
  const bool alone = group.size() == 1 && drive_of_[first] != kUndriven && stands_free(first);
  const RigidState before = now_[first];
  if (alone && step_group(from, group, Solver::kExact)) return;
  now_[first] = before;
  KILOTWIN_DEMAND(step_group(from, group, Solver::kIterative));
}

bool OdeEngine::step_group(Tick from, std::span<const std::uint32_t> group, Solver solver) {
  world_.clear();
  for (const std::uint32_t i : group) {
    in_world_[i] = world_.add(kind(i).inertia, now_[i]);
    const Axes axes(now_[i].rotation);
    start_axis_[i] = level(axes.x[0], axes.x[1], {1, 0, 0});
  }
  const std::uint32_t leader = group[0];
  const std::uint32_t lowest = is_robot(leader) ? population_.known().robot[leader]
                                                : static_cast<std::uint32_t>(states_.size()) + movable_of(leader);
  for (std::uint32_t s = 0; s < limits_.sub_steps; ++s) {
    const double since_s = (s + 1) * limits_.sub_step_s;
    for (const std::uint32_t i : group) {
      touch_floor(i);
      touch_walls(i);
      touch_obstacles(i);
      if (is_robot(i)) touch_robots(i, since_s);
    }
    for (const auto& [i, m] : near_) {
      if (leader_[i] != leader && leader_[m] != leader) continue;
      if (not_simulated_[i] != 0) {
        touch_pair(m, i, since_s);
      } else {
        touch_pair(i, m, since_s);
      }
    }
    if (!world_.step(solver, random_.bits(Stream::kSolver, lowest, from, s), !is_robot(group.back()))) return false;
    for (const std::uint32_t i : group) world_.read(in_world_[i], now_[i]);
  }
  return true;
}

void OdeEngine::keep(std::uint32_t i) {
  const RigidState& state = now_[i];
  if (!is_robot(i)) {
    movable_states_[movable_of(i)] = state;
    return;
  }
  Bodies& known = population_.known();
  states_[known.robot[i]] = state;
  known.x_mm[i] = state.position_mm[0];
  known.y_mm[i] = state.position_mm[1];
  known.heading_rad[i] = heading_of(state);
}

void OdeEngine::add_movables(BodyFrame& frame) const {
  frame.movable.clear();
  auto& [body, x_mm, y_mm, heading_rad, velocity_x, velocity_y, turn] = frame.movable;
  for (std::uint32_t m = 0; m < movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const RigidState& state = movable_states_[m];
    body.push_back(m);
    x_mm.push_back(state.position_mm[0]);
    y_mm.push_back(state.position_mm[1]);
    heading_rad.push_back(heading_of(state));
    velocity_x.push_back(state.velocity_mm_s[0] * limits_.sub_step_s);
    velocity_y.push_back(state.velocity_mm_s[1] * limits_.sub_step_s);
    turn.push_back(state.spin_rad_s[2] * limits_.sub_step_s);
  }
}

void OdeEngine::emit_bodies(BodyFrame& frame) const {
  PopulationEngine::emit_bodies(frame);
  add_movables(frame);
}

void OdeEngine::emit_ghosts(PartitionId neighbour, BodyFrame& frame) const {
  frame.clear();
  frame.tick = population_.tick();
  const Rectangle& rectangle = grid_.rectangle(neighbour);
  const Bodies& listed = population_.listed();
  // Other partitions' movable bodies are one tick old here.
  const double margin_mm = population_.ghost_margin_mm() + (movable_.empty() ? 0 : limits_.reach_mm);
  for (std::size_t i = 0; i < listed.size(); ++i) {
    if (listed.tracked[i] == 0 && distance_mm(rectangle, listed.x_mm[i], listed.y_mm[i]) <= margin_mm)
      population_.add_ghost(i, frame);
  }
  add_movables(frame);
  frame.spatial.resize((frame.robot.size() + frame.movable.body.size()) * BodyFrame::kSpatialColumns);
  double* columns = frame.spatial.data();
  for (const std::uint32_t robot : frame.robot) columns = pack(states_[robot], columns);
  for (const std::uint32_t m : frame.movable.body) columns = pack(movable_states_[m], columns);
}

std::uint64_t OdeEngine::hash_part() const {
  std::uint64_t sum = PopulationEngine::hash_part();
  for (std::uint32_t m = 0; m < movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const RigidState& state = movable_states_[m];
    sum += entity_hash(
        HashDomain::kMovable, m,
        {hash_bits(state.position_mm[0]), hash_bits(state.position_mm[1]), hash_bits(heading_of(state))});
  }
  return sum;
}

void OdeEngine::save(proto::PhysicsState& saved) const {
  PopulationEngine::save(saved);
  std::array<double, BodyFrame::kSpatialColumns> packed;
  const auto add = [&](const RigidState& state) {
    pack(state, packed.data());
    saved.mutable_spatial()->Add(packed.begin(), packed.end());
  };
  for (const std::uint32_t robot : population_.listed().robot) add(states_[robot]);
  for (std::uint32_t m = 0; m < movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const RigidState& state = movable_states_[m];
    saved.add_movable(m);
    for (const double value : {state.position_mm[0], state.position_mm[1], heading_of(state),
                               state.velocity_mm_s[0], state.velocity_mm_s[1], state.spin_rad_s[2]}) {
      saved.add_movable_state(value);
    }
    add(state);
  }
}

void OdeEngine::load(Tick tick, std::span<const proto::PhysicsState* const> parts) {
  constexpr int kColumns = BodyFrame::kSpatialColumns;
  std::vector<std::uint8_t> seen(movable_.size(), 0);
  std::size_t found = 0;
  for (const proto::PhysicsState* part : parts) {
    if (part->spatial_size() != (part->robot_size() + part->movable_size()) * kColumns ||
        part->movable_state_size() != 6 * part->movable_size()) {
      throw RunError("checkpoint: physics: columns of unequal length; the file is damaged");
    }
    for (const std::uint32_t m : part->movable()) {
      if (m >= movable_.size() || seen[m]++ != 0)
        throw RunError("checkpoint: physics: movable body " + std::to_string(m) + " is unknown or occurs twice");
      ++found;
    }
  }
  if (found != movable_.size()) throw RunError("checkpoint: physics: a movable body is missing");
  PopulationEngine::load(tick, parts);
  for (const proto::PhysicsState* part : parts) {
    const double* columns = part->spatial().data();
    for (int i = 0; i < part->robot_size(); ++i, columns += kColumns)
      states_[part->robot(i)] = unpacked(part->x_mm(i), part->y_mm(i), columns);
    for (int i = 0; i < part->movable_size(); ++i, columns += kColumns) {
      const double* const at = part->movable_state().data() + 6 * i;
      movable_states_[part->movable(i)] = unpacked(at[0], at[1], columns);
    }
  }
  list_movables();
}

}  // namespace kilotwin::physics

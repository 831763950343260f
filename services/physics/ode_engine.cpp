#include "services/physics/ode_engine.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;
constexpr double kGravity_mm_s2 = 9806.65;
/// Below these a robot that nothing drives is at rest, and is stopped.
constexpr double kRestSpeed_mm_s = 0.01, kRestSpin_rad_s = 0.001;
/// A robot that slides faster than this is braked against its way, a slower one against the slope.
constexpr double kSlidingSpeed_mm_s = 0.1;
/// Robots at rest may overlap this little, which is rounding and the solver's softness.
constexpr double kRestDistance_mm = 2 * kRobotRadius_mm - 0.001;
constexpr double kMilliNewton_g_mm_s2 = 1000;

/// The body's axes in the arena's frame.
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

/// The unit vector along (x, y), or the fallback where that is 0.
Vector3 level(double x, double y, const Vector3& fallback) {
  const double length = __builtin_sqrt(x * x + y * y);
  if (!(length > 0)) return fallback;
  return {x / length, y / length, 0};
}

double square_of(const Vector3& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

void pack(const RigidState& state, double* columns) {
  *columns++ = state.position_mm[2];
  columns = std::copy(state.rotation.begin(), state.rotation.end(), columns);
  columns = std::copy(state.velocity_mm_s.begin(), state.velocity_mm_s.end(), columns);
  std::copy(state.spin_rad_s.begin(), state.spin_rad_s.end(), columns);
}

RigidState unpacked(double x_mm, double y_mm, const double* columns) {
  RigidState state;
  state.position_mm = {x_mm, y_mm, columns[0]};
  std::copy_n(columns + 1, 4, state.rotation.begin());
  std::copy_n(columns + 5, 3, state.velocity_mm_s.begin());
  std::copy_n(columns + 8, 3, state.spin_rad_s.begin());
  return state;
}

Vector3 downhill_of(const proto::Physics& physics) {
  double sine, cosine;
  kt_sincos(physics.downhill_deg() * (kPi / 180), &sine, &cosine);
  return {cosine, sine, 0};
}

Vector3 gravity_of(const proto::Physics& physics) {
  double sine, cosine;
  kt_sincos(physics.tilt_deg() * (kPi / 180), &sine, &cosine);
  const Vector3 downhill = downhill_of(physics);
  return {kGravity_mm_s2 * sine * downhill[0], kGravity_mm_s2 * sine * downhill[1], -kGravity_mm_s2 * cosine};
}

/// Whether a robot at rest stays so.
bool holds(const proto::Physics& physics, double grip) {
  double sine, cosine;
  kt_sincos(physics.tilt_deg() * (kPi / 180), &sine, &cosine);
  return sine < grip * cosine;
}

}  // namespace

bool OdeLimits::outside(double x_mm, double y_mm) const {
  return x_mm > x_limit_mm || x_mm < -x_limit_mm || y_mm > y_limit_mm || y_mm < -y_limit_mm;
}

OdeLimits::OdeLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.experiment().physics().sub_steps(), 1u, 4u)) {
  const double tick_s = plan.tick_length.seconds();
  const double width_mm = plan.experiment().arena().width_mm(), height_mm = plan.experiment().arena().height_mm();
  sub_step_s = tick_s / sub_steps;
  const Vector3 gravity = gravity_of(plan.experiment().physics());
  const double along_mm_s2 = __builtin_sqrt(gravity[0] * gravity[0] + gravity[1] * gravity[1]);
  const double diagonal_mm = __builtin_sqrt(width_mm * width_mm + height_mm * height_mm);
  top_speed_mm_s =
      std::max(kSeparation_mm_s, drive.top_speed_mm_s()) + __builtin_sqrt(2 * along_mm_s2 * diagonal_mm);
  const double stride_mm = top_speed_mm_s * tick_s;
  reach_mm = 2 * stride_mm;
  const double hop_mm = 2 * kRobotRadius_mm + reach_mm;
  rim_mm = (kReachHops - 1) * hop_mm;
  margin_mm = kReachHops * hop_mm + stride_mm;
  x_limit_mm = width_mm / 2 - kRobotRadius_mm;
  y_limit_mm = height_mm / 2 - kRobotRadius_mm;
}

OdeEngine::OdeEngine(const RunPlan& plan, PartitionId partition) : OdeEngine(plan, partition, DriveModel(plan)) {}

OdeEngine::OdeEngine(const RunPlan& plan, PartitionId partition, const DriveModel& drive)
    : PopulationEngine(plan, partition, drive, OdeLimits(plan, drive).margin_mm),
      rectangle_(plan.grid.rectangle(partition)),
      limits_(plan, drive),
      random_(plan.seed()),
      inertia_(Inertia::cylinder(10, kRobotRadius_mm, kRobotHeight_mm)),
      rest_grip_(0.3),
      thrust_g_mm_s2_(11.77 * kMilliNewton_g_mm_s2),
      downhill_(downhill_of(plan.experiment().physics())),
      holds_on_slope_(holds(plan.experiment().physics(), rest_grip_)),
      world_(gravity_of(plan.experiment().physics()), limits_.sub_step_s),
      candidates_(2 * kRobotRadius_mm + limits_.reach_mm),
      states_(plan.robots()) {
  const proto::Motion& motion = plan.experiment().motion();
  const double half_base_mm = motion.wheel_base_mm() / 2;
  legs_mm_ = {{{-motion.axle_offset_mm(), half_base_mm, -kRobotHeight_mm / 2},
               {-motion.axle_offset_mm(), -half_base_mm, -kRobotHeight_mm / 2},
               {kRobotRadius_mm, 0, -kRobotHeight_mm / 2}}};
  const Bodies& listed = population_.listed();
  for (std::size_t i = 0; i < listed.size(); ++i)
    states_[listed.robot[i]] = upright(listed.x_mm[i], listed.y_mm[i], listed.heading_rad[i]);
}

RigidState OdeEngine::upright(double x_mm, double y_mm, double heading_rad) const {
  RigidState state;
  state.position_mm = {x_mm, y_mm, kRobotHeight_mm / 2};
  double sine, cosine;
  kt_sincos(heading_rad / 2, &sine, &cosine);
  state.rotation = {cosine, 0, 0, sine};
  return state;
}

void OdeEngine::move(Tick from, const Inputs& inputs) {
  Bodies& known = population_.known();
  const std::vector<std::uint8_t>& own = population_.own();
  read_ghosts(inputs);
  now_.resize(known.size());
  stands_.resize(known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    const double x = known.x_mm[i], y = known.y_mm[i];
    now_[i] = known.tracked[i] != 0 ? upright(x, y, known.heading_rad[i]) : states_[known.robot[i]];
    stands_[i] = known.tracked[i] != 0 || rectangle_.distance_mm(x, y) > limits_.rim_mm;
  }
  set_off(from);
  candidates_.update(known);
  in_world_.resize(known.size());
  start_axis_.resize(known.size());
  make_groups();
  std::uint32_t first = 0;
  for (const std::uint32_t end : group_end_) {
    const std::span<const std::uint32_t> group(order_.data() + first, order_.data() + end);
    first = end;
    if (stands_[group[0]] != 0) continue;  // These are groups of their own.
    if (!own.empty() && std::none_of(group.begin(), group.end(), [&](std::uint32_t i) { return own[i] != 0; }))
      continue;
    if (rests(group)) {
      for (const std::uint32_t i : group) now_[i].velocity_mm_s = now_[i].spin_rad_s = {};
    } else {
      step_group(from, group);
    }
    for (const std::uint32_t i : group) {
      if (!own.empty() && own[i] == 0) continue;
      const RigidState& state = now_[i];
      states_[known.robot[i]] = state;
      known.x_mm[i] = state.position_mm[0];
      known.y_mm[i] = state.position_mm[1];
      const Axes axes(state.rotation);
      known.heading_rad[i] = wrapped(kt_atan2(axes.x[1], axes.x[0]));
    }
  }
}

void OdeEngine::read_ghosts(const Inputs& inputs) {
  for (const BodyFrame* frame : inputs.ghosts) {
    KILOTWIN_DEMAND(frame->spatial.size() == frame->robot.size() * BodyFrame::kSpatialColumns);
    for (std::size_t g = 0; g < frame->robot.size(); ++g) {
      states_[frame->robot[g]] =
          unpacked(frame->x_mm[g], frame->y_mm[g], frame->spatial.data() + g * BodyFrame::kSpatialColumns);
    }
  }
}

void OdeEngine::set_off(Tick from) {
  const Bodies& known = population_.known();
  const std::vector<Duties>& duties = population_.duties();
  drives_.reserve(known.size());
  drives_.count = 0;
  drive_of_.assign(known.size(), kNone);
  for (std::uint32_t i = 0; i < known.size(); ++i) {
    if (!duties[i].any()) continue;
    drive_of_[i] = static_cast<std::uint32_t>(drives_.count);
    population_.drive().add(drives_, i, known.robot[i], from, duties[i], known.heading_rad[i],
                            1.0 / limits_.sub_steps);
  }
  population_.drive().integrate(drives_);
}

void OdeEngine::make_groups() {
  const Bodies& known = population_.known();
  const auto count = static_cast<std::uint32_t>(known.size());
  const double reach_mm = 2 * kRobotRadius_mm + limits_.reach_mm, reach_square_mm2 = reach_mm * reach_mm;
  // The leader of a group is its lowest body; found by union with halved paths.
  leader_.resize(count);
  const auto leader = [this](std::uint32_t i) {
    while (leader_[i] != i) i = leader_[i] = leader_[leader_[i]];
    return i;
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    leader_[i] = i;
    if (stands_[i] != 0) continue;
    for (const std::uint32_t j : candidates_.of(i)) {
      if (j >= i) break;
      const double dx = known.x_mm[i] - known.x_mm[j], dy = known.y_mm[i] - known.y_mm[j];
      if (stands_[j] != 0 || dx * dx + dy * dy > reach_square_mm2) continue;
      const std::uint32_t a = leader(i), b = leader(j);
      leader_[std::max(a, b)] = std::min(a, b);
    }
  }
  // Sorted by leaders, ascending within; a counting sort.
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
  const double x = known.x_mm[i], y = known.y_mm[i], reach_mm = limits_.reach_mm;
  if (x > limits_.x_limit_mm - reach_mm || x < reach_mm - limits_.x_limit_mm || y > limits_.y_limit_mm - reach_mm ||
      y < reach_mm - limits_.y_limit_mm) {
    return false;
  }
  const double near_mm = 2 * kRobotRadius_mm + reach_mm;
  for (const std::uint32_t j : candidates_.of(i)) {
    const double dx = known.x_mm[j] - x, dy = known.y_mm[j] - y;
    if (dx * dx + dy * dy <= near_mm * near_mm) return false;
  }
  return true;
}

bool OdeEngine::rests(std::span<const std::uint32_t> group) const {
  if (!holds_on_slope_) return false;
  const Bodies& known = population_.known();
  for (const std::uint32_t i : group) {
    const RigidState& state = now_[i];
    if (drive_of_[i] != kNone || square_of(state.velocity_mm_s) > kRestSpeed_mm_s * kRestSpeed_mm_s ||
        square_of(state.spin_rad_s) > kRestSpin_rad_s * kRestSpin_rad_s ||
        limits_.outside(state.position_mm[0], state.position_mm[1])) {
      return false;
    }
    for (const std::uint32_t j : candidates_.of(i)) {
      const double dx = known.x_mm[i] - known.x_mm[j], dy = known.y_mm[i] - known.y_mm[j];
      if (dx * dx + dy * dy < kRestDistance_mm * kRestDistance_mm) return false;
    }
  }
  return true;
}

void OdeEngine::step_group(Tick from, std::span<const std::uint32_t> group) {
  const std::uint32_t first = group[0];
  const bool alone = group.size() == 1 && drive_of_[first] != kNone && stands_free(first);
  const RigidState before = now_[first];
  if (alone && step_group(from, group, Solver::kExact)) return;
  now_[first] = before;
  KILOTWIN_DEMAND(step_group(from, group, Solver::kIterative));
}

bool OdeEngine::step_group(Tick from, std::span<const std::uint32_t> group, Solver solver) {
  world_.clear();
  for (const std::uint32_t i : group) {
    in_world_[i] = world_.add(inertia_, now_[i]);
    const Axes axes(now_[i].rotation);
    start_axis_[i] = level(axes.x[0], axes.x[1], {1, 0, 0});
  }
  for (std::uint32_t s = 0; s < limits_.sub_steps; ++s) {
    for (const std::uint32_t i : group) {
      touch_floor(i);
      touch_walls(i);
      touch_others(i, (s + 1) * limits_.sub_step_s);
    }
    const std::uint32_t lowest = population_.known().robot[group[0]];
    if (!world_.step(solver, random_.bits(Stream::kSolver, lowest, from, s))) return false;
    for (const std::uint32_t i : group) world_.read(in_world_[i], now_[i]);
  }
  return true;
}

void OdeEngine::touch_floor(std::uint32_t i) {
  const RigidState& state = now_[i];
  const Axes axes(state.rotation);
  const Vector3 ahead = level(axes.x[0], axes.x[1], start_axis_[i]);
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = TouchPoint::kStanding;
  touch.normal = {0, 0, 1};
  double velocity_x = 0, velocity_y = 0, spin = 0;
  const std::uint32_t d = drive_of_[i];
  if (d != kNone) {
    // The drive's displacement within a sub-step was computed for the heading at the tick's start.
    const Vector3& start = start_axis_[i];
    const double cosine = start[0] * ahead[0] + start[1] * ahead[1],
                 sine = start[0] * ahead[1] - start[1] * ahead[0];
    velocity_x = (cosine * drives_.x_mm[d] - sine * drives_.y_mm[d]) / limits_.sub_step_s;
    velocity_y = (sine * drives_.x_mm[d] + cosine * drives_.y_mm[d]) / limits_.sub_step_s;
    spin = drives_.turn_rad[d] / (limits_.sub_step_s * limits_.sub_steps);
    touch.friction = TouchPoint::Friction::kBounded;
    touch.axis = ahead;
  } else {
    touch.friction = TouchPoint::Friction::kCoulomb;
    touch.axis = square_of(state.velocity_mm_s) > kSlidingSpeed_mm_s * kSlidingSpeed_mm_s
                     ? level(state.velocity_mm_s[0], state.velocity_mm_s[1], downhill_)
                     : downhill_;
  }
  for (std::size_t leg = 0; leg < legs_mm_.size(); ++leg) {
    const Vector3 arm = axes.to_arena(legs_mm_[leg]);
    for (std::size_t k = 0; k < 3; ++k) touch.at_mm[k] = state.position_mm[k] + arm[k];
    touch.gap_mm = touch.at_mm[2];
    if (d != kNone) {
      // The rear legs push along their ways. They lie on the axle, so that one holds it sideways for both; with the front
      // leg it keeps the robot from turning.
      touch.grip[0] = leg < 2 ? thrust_g_mm_s2_ / 2 : 0;
      touch.grip[1] = leg == 0 ? thrust_g_mm_s2_ * 2 / 3 : leg == 2 ? thrust_g_mm_s2_ / 3 : 0;
      const double x = velocity_x - spin * arm[1], y = velocity_y + spin * arm[0];
      touch.motion_mm_s[0] = x * ahead[0] + y * ahead[1];
      touch.motion_mm_s[1] = y * ahead[0] - x * ahead[1];
    } else {
      touch.grip[0] = touch.grip[1] = rest_grip_;
    }
    world_.add(touch);
  }
}

void OdeEngine::touch_walls(std::uint32_t i) {
  const Vector3& centre = now_[i].position_mm;
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = TouchPoint::kStanding;
  touch.axis = {0, 0, 1};
  for (std::size_t k = 0; k < 2; ++k) {
    const double limit_mm = k == 0 ? limits_.x_limit_mm : limits_.y_limit_mm;
    for (const double side : {-1.0, 1.0}) {
      touch.gap_mm = limit_mm - side * centre[k];
      if (touch.gap_mm > limits_.reach_mm) continue;
      touch.normal = {0, 0, 0};
      touch.normal[k] = -side;
      touch.at_mm = centre;
      touch.at_mm[k] += side * kRobotRadius_mm;
      world_.add(touch);
    }
  }
}

void OdeEngine::touch_others(std::uint32_t i, double since_s) {
  const Vector3& here = now_[i].position_mm;
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.axis = {0, 0, 1};
  for (const std::uint32_t j : candidates_.of(i)) {
    const bool stands = stands_[j] != 0;
    if (!stands && (j < i || leader_[j] != leader_[i])) continue;
    Vector3 there = now_[j].position_mm;
    if (stands) {
      for (std::size_t k = 0; k < 2; ++k) there[k] += now_[j].velocity_mm_s[k] * since_s;
    }
    const double dx = here[0] - there[0], dy = here[1] - there[1];
    const double distance_mm = __builtin_sqrt(dx * dx + dy * dy);
    touch.gap_mm = distance_mm - 2 * kRobotRadius_mm;
    if (touch.gap_mm > limits_.reach_mm) continue;
    touch.other = stands ? TouchPoint::kStanding : in_world_[j];
    touch.normal = level(dx, dy, {i < j ? -1.0 : 1.0, 0, 0});
    for (std::size_t k = 0; k < 2; ++k)
      touch.at_mm[k] = there[k] + touch.normal[k] * (kRobotRadius_mm + touch.gap_mm / 2);
    touch.at_mm[2] = (here[2] + there[2]) / 2;
    world_.add(touch);
  }
}

void OdeEngine::emit_ghosts(PartitionId neighbour, BodyFrame& frame) const {
  PopulationEngine::emit_ghosts(neighbour, frame);
  frame.spatial.resize(frame.robot.size() * BodyFrame::kSpatialColumns);
  for (std::size_t i = 0; i < frame.robot.size(); ++i)
    pack(states_[frame.robot[i]], frame.spatial.data() + i * BodyFrame::kSpatialColumns);
}

void OdeEngine::save(proto::PhysicsState& state) const {
  PopulationEngine::save(state);
  std::array<double, BodyFrame::kSpatialColumns> packed;
  for (const std::uint32_t robot : population_.listed().robot) {
    pack(states_[robot], packed.data());
    state.mutable_spatial()->Add(packed.begin(), packed.end());
  }
}

void OdeEngine::load(Tick tick, std::span<const proto::PhysicsState* const> parts) {
  constexpr int kColumns = BodyFrame::kSpatialColumns;
  for (const proto::PhysicsState* part : parts) {
    if (part->spatial_size() != part->robot_size() * kColumns)
      throw RunError("checkpoint: physics: columns of unequal length; the file is damaged");
  }
  PopulationEngine::load(tick, parts);
  for (const proto::PhysicsState* part : parts) {
    for (int i = 0; i < part->robot_size(); ++i)
      states_[part->robot(i)] = unpacked(part->x_mm(i), part->y_mm(i), part->spatial().data() + i * kColumns);
  }
}

}  // namespace kilotwin::physics

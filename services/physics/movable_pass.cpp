#include "services/physics/movable_pass.hpp"

#include <algorithm>

#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

/// How often limits are met one after the other; what is missed then scales all down.
constexpr int kRounds = 8;
constexpr double kTolerance_mm = 1e-14;

}  // namespace

MovablePass::MovablePass(const RunPlan& plan, const ContactLimits& limits)
    : world_(plan.world),
      bodies_(world_.movables),
      stride_mm_(limits.stride_mm),
      touch_mm_(limits.touch_mm),
      range_mm_(2 * limits.sub_steps * limits.stride_mm),
      robot_kg_(plan.experiment().physics().robot_mass_g() / 1000),
      mover_of_(plan.movables(), kNone) {
  const double sub_step_s = plan.tick_length.seconds() / limits.sub_steps;
  for (const MovableBodyModel& body : bodies_)
    grip_mm_.push_back(body.friction * kGravity_m_s2 * 1000 * sub_step_s * sub_step_s / kInertia);
}

/// Stable whatever touches whatever: below one over the sum, over a contact's two ends, of what a force there moves all the
/// contacts of that end (Gershgorin): at most 4 at a robot.
double MovablePass::gain(std::uint32_t movable, std::size_t robots) const {
  const MovableBodyModel& body = bodies_[movable];
  const double lever = body.shape.reach_mm() / body.shape.mean_distance_mm();
  return 1 / (4 + robot_kg_ / body.mass_kg * static_cast<double>(robots) * (1 + lever * lever));
}

void MovablePass::clear() {
  for (const Mover& mover : movers_) mover_of_[mover.movable] = kNone;
  movers_.clear();
}

void MovablePass::add(std::uint32_t movable, std::uint32_t passes) {
  mover_of_[movable] = static_cast<std::uint32_t>(movers_.size());
  Mover& mover = movers_.emplace_back();
  mover.movable = movable;
  mover.passes = passes;
}

void MovablePass::add_stop(Mover& mover, const MovableState& state, double normal_x, double normal_y, double gap_mm,
                           Point2 at, std::uint32_t other, const MovableState* other_state) const {
  if (gap_mm > range_mm_) return;
  Stop stop{normal_x, normal_y, at.x_mm - state.x_mm, at.y_mm - state.y_mm, gap_mm, other, 0, 0};
  if (other_state != nullptr) {
    stop.other_lever_x_mm = at.x_mm - other_state->x_mm;
    stop.other_lever_y_mm = at.y_mm - other_state->y_mm;
  }
  mover.stops.push_back(stop);
}

void MovablePass::find_stops(Mover& mover, const std::vector<MovableState>& states) const {
  const MovableState& state = states[mover.movable];
  const Convex& shape = bodies_[mover.movable].shape;
  const Place place = Place::at(state.x_mm, state.y_mm, state.heading_rad);
  const ArenaShape& arena = world_.arena;
  const auto with_line = [&](double nx, double ny, double offset_mm) {  // n . p <= offset within
    if (shape.is_disc()) {
      const double r = shape.radius_mm();
      add_stop(mover, state, nx, ny, offset_mm - (nx * state.x_mm + ny * state.y_mm) - r,
               {state.x_mm + r * nx, state.y_mm + r * ny});
    }
    for (const Point2 corner : shape.corners()) {
      const Point2 p = place.to_arena(corner);
      add_stop(mover, state, nx, ny, offset_mm - (nx * p.x_mm + ny * p.y_mm), p);
    }
  };
  if (arena.kind() == ArenaShape::Kind::kRectangle) {
    with_line(1, 0, arena.half_width_mm());
    with_line(-1, 0, arena.half_width_mm());
    with_line(0, 1, arena.half_height_mm());
    with_line(0, -1, arena.half_height_mm());
  }
  for (std::size_t e = 0; e < arena.corners().size(); ++e) {
    const Point2 n = arena.normals()[e], c = arena.corners()[e];
    with_line(n.x_mm, n.y_mm, n.x_mm * c.x_mm + n.y_mm * c.y_mm);
  }
  if (arena.kind() == ArenaShape::Kind::kCircle) {
    const auto with_rim = [&](Point2 p, double radius_mm) {
      const double r = __builtin_sqrt(p.x_mm * p.x_mm + p.y_mm * p.y_mm);
      if (r == 0) return;
      const double nx = p.x_mm / r, ny = p.y_mm / r;
      add_stop(mover, state, nx, ny, arena.radius_mm() - r - radius_mm,
               {p.x_mm + radius_mm * nx, p.y_mm + radius_mm * ny});
    };
    if (shape.is_disc()) with_rim({state.x_mm, state.y_mm}, shape.radius_mm());
    for (const Point2 corner : shape.corners()) with_rim(place.to_arena(corner), 0);
  }
  const auto with_shape = [&](const Convex& other, const Place& at, std::uint32_t number,
                              const MovableState* theirs) {
    const double dx = at.x_mm - state.x_mm, dy = at.y_mm - state.y_mm;
    const double near_mm = other.reach_mm() + shape.reach_mm() + range_mm_;
    if (dx * dx + dy * dy > near_mm * near_mm) return;
    const auto mine = [&](Point2 p, double radius_mm) {
      const Nearest n = other.nearest(at, p);
      add_stop(mover, state, -n.normal_x, -n.normal_y, n.distance_mm - radius_mm, n.at, number, theirs);
    };
    const auto its = [&](Point2 p, double radius_mm) {
      const Nearest n = shape.nearest(place, p);
      add_stop(mover, state, n.normal_x, n.normal_y, n.distance_mm - radius_mm, n.at, number, theirs);
    };
    if (shape.is_disc()) mine({state.x_mm, state.y_mm}, shape.radius_mm());
    for (const Point2 corner : shape.corners()) mine(place.to_arena(corner), 0);
    if (other.is_disc()) its({at.x_mm, at.y_mm}, other.radius_mm());
    for (const Point2 corner : other.corners()) its(at.to_arena(corner), 0);
  };
  for (const ObstacleBody& body : world_.obstacles) with_shape(body.shape, body.place, kNone, nullptr);
  for (std::uint32_t m = 0; m < states.size(); ++m) {
    if (m == mover.movable) continue;
    with_shape(bodies_[m].shape, Place::at(states[m].x_mm, states[m].y_mm, states[m].heading_rad), m, &states[m]);
  }
}

void MovablePass::move_points(const Mover& mover, const Motion& shift, const Motion& swing,
                              double* (ContactPass::*of)(ContactPass::Seat), ContactPass& pass) const {
  const double rho_mm = bodies_[mover.movable].shape.mean_distance_mm();
  for (const Contact& c : mover.contacts) {
    double* const point = (pass.*of)(c.point);
    point[0] = shift.x_mm - c.lever_y_mm * (shift.turn_mm / rho_mm);
    point[kLanes] = shift.y_mm + c.lever_x_mm * (shift.turn_mm / rho_mm);
    point[2 * kLanes] = swing.x_mm - c.lever_y_mm * (swing.turn_mm / rho_mm);
    point[3 * kLanes] = swing.y_mm + c.lever_x_mm * (swing.turn_mm / rho_mm);
  }
}

void MovablePass::set_off(const std::vector<MovableState>& states, ContactPass& pass) {
  for (Mover& mover : movers_) {
    const MovableState& state = states[mover.movable];
    mover.velocity = {state.vx_mm, state.vy_mm, state.turn_rad * bodies_[mover.movable].shape.mean_distance_mm()};
    find_stops(mover, states);
    move_points(mover, {}, mover.velocity, &ContactPass::start, pass);
  }
}

void MovablePass::sub_step(std::uint32_t step, ContactPass& pass) {
  for (Mover& mover : movers_) {
    if (step < mover.passes) move(mover, pass);
  }
  for (Mover& mover : movers_) mover.shift = mover.next_shift;
}

void MovablePass::move(Mover& mover, ContactPass& pass) {
  const MovableBodyModel& body = bodies_[mover.movable];
  const double rho_mm = body.shape.mean_distance_mm(), share = robot_kg_ / body.mass_kg;
  const auto arm = [&](const auto& c) { return (c.lever_x_mm * c.normal_y - c.lever_y_mm * c.normal_x) / rho_mm; };
  Motion force;
  for (Contact& c : mover.contacts) {
    // The same expressions as on the robot's side, and so the same bits.
    const double* const robot = pass.now(c.robot);
    const double* const point = pass.now(c.point);
    const double gap =
        c.gap_mm + (c.normal_x * (point[0] - robot[0]) + c.normal_y * (point[kLanes] - robot[kLanes]));
    const double closing =
        c.normal_x * (robot[2 * kLanes] - point[2 * kLanes]) + c.normal_y * (robot[3 * kLanes] - point[3 * kLanes]);
    c.push_mm = std::max(c.push_mm + c.gain * (closing - kEase * std::max(gap - touch_mm_, 0.0)), 0.0);
    force.x_mm += c.push_mm * c.normal_x;
    force.y_mm += c.push_mm * c.normal_y;
    force.turn_mm += c.push_mm * arm(c);
  }
  const Motion before = mover.velocity;
  Motion v{before.x_mm + share * force.x_mm, before.y_mm + share * force.y_mm,
           before.turn_mm + share * force.turn_mm};
  const double length = __builtin_sqrt(v.x_mm * v.x_mm + v.y_mm * v.y_mm + v.turn_mm * v.turn_mm);
  const double grip = grip_mm_[mover.movable], keep = length > grip ? (length - grip) / length : 0;
  v = {v.x_mm * keep, v.y_mm * keep, v.turn_mm * keep};

  const auto take = [](Motion& m, double nx, double ny, double lever, double excess) {
    const double part = excess / (1 + lever * lever);
    m.x_mm -= part * nx;
    m.y_mm -= part * ny;
    m.turn_mm -= part * lever;
  };
  const auto room = [&](const Stop& s) {
    double gap = s.gap_mm - along(mover.shift, s.normal_x, s.normal_y, arm(s));
    if (s.other == kNone) return std::max(gap, 0.0);
    if (mover_of_[s.other] != kNone) {
      const Mover& other = movers_[mover_of_[s.other]];
      const double other_rho_mm = bodies_[s.other].shape.mean_distance_mm();
      gap += along(other.shift, s.normal_x, s.normal_y,
                   (s.other_lever_x_mm * s.normal_y - s.other_lever_y_mm * s.normal_x) / other_rho_mm);
    }
    return std::max(gap / 2, 0.0);
  };
  for (int round = 0; round < kRounds; ++round) {
    for (const Stop& s : mover.stops) {
      const double excess = along(v, s.normal_x, s.normal_y, arm(s)) - room(s);
      if (excess > kTolerance_mm) take(v, s.normal_x, s.normal_y, arm(s), excess);
    }
  }
  mover.velocity = v;
  const Motion swing{(v.x_mm + v.x_mm) - before.x_mm, (v.y_mm + v.y_mm) - before.y_mm,
                     (v.turn_mm + v.turn_mm) - before.turn_mm};

  // The way: at most half of each gap towards robots and other bodies.
  Motion way = v;
  const auto half_gap = [&](const Contact& c) {
    const double* const robot = pass.now(c.robot);
    const double* const point = pass.now(c.point);
    const double gap =
        c.gap_mm + (c.normal_x * (point[0] - robot[0]) + c.normal_y * (point[kLanes] - robot[kLanes]));
    return std::max(gap / 2, 0.0);
  };
  for (int round = 0; round < kRounds; ++round) {
    for (const Contact& c : mover.contacts) {
      const double excess = -along(way, c.normal_x, c.normal_y, arm(c)) - half_gap(c);
      if (excess > kTolerance_mm) take(way, -c.normal_x, -c.normal_y, -arm(c), excess);
    }
    for (const Stop& s : mover.stops) {
      const double excess = along(way, s.normal_x, s.normal_y, arm(s)) - room(s);
      if (excess > kTolerance_mm) take(way, s.normal_x, s.normal_y, arm(s), excess);
    }
  }
  double scale = 1;
  const auto hold = [&](double closing, double limit) {
    if (closing > limit + kTolerance_mm && scale * closing > limit) scale = limit / closing;
  };
  for (const Contact& c : mover.contacts) hold(-along(way, c.normal_x, c.normal_y, arm(c)), half_gap(c));
  for (const Stop& s : mover.stops) hold(along(way, s.normal_x, s.normal_y, arm(s)), room(s));
  const double turn = way.turn_mm < 0 ? -way.turn_mm : way.turn_mm;
  const double farthest =
      __builtin_sqrt(way.x_mm * way.x_mm + way.y_mm * way.y_mm) + turn * (body.shape.reach_mm() / rho_mm);
  if (scale * farthest > stride_mm_) scale = stride_mm_ / farthest;
  mover.next_shift = {mover.shift.x_mm + scale * way.x_mm, mover.shift.y_mm + scale * way.y_mm,
                      mover.shift.turn_mm + scale * way.turn_mm};
  move_points(mover, mover.next_shift, swing, &ContactPass::after, pass);
}

void MovablePass::finish(std::vector<MovableState>& states) const {
  for (const Mover& mover : movers_) {
    MovableState& state = states[mover.movable];
    const double rho_mm = bodies_[mover.movable].shape.mean_distance_mm();
    state.x_mm += mover.shift.x_mm;
    state.y_mm += mover.shift.y_mm;
    state.heading_rad = wrapped(state.heading_rad + mover.shift.turn_mm / rho_mm);
    state.vx_mm = mover.velocity.x_mm;
    state.vy_mm = mover.velocity.y_mm;
    state.turn_rad = mover.velocity.turn_mm / rho_mm;
  }
}

}  // namespace kilotwin::physics

#include "services/physics/movable_pass.hpp"

#include <algorithm>

#include "core/plan/physics_settings.hpp"

namespace kilotwin::physics {
namespace {

/// Number of limits that are met one after the other. Remaining violations scale the displacement down.
constexpr int kRounds = 8;
/// Rounds of projected Gauss-Seidel over contacts between movable bodies and friction, and their over-relaxation. With
/// over-relaxation, bodies that friction holds come to rest exactly. A light body between heavy ones needs the most rounds.
constexpr int kBalanceRounds = 128;
constexpr double kRelaxation = 1.5;
constexpr double kTolerance_mm = 1e-14;

}  // namespace

MovablePass::MovablePass(const RunPlan& plan, const ContactLimits& limits)
    : world_(plan.world),
      bodies_(world_.movables),
      stride_mm_(limits.stride_mm),
      touch_mm_(limits.touch_mm),
      range_mm_(2 * limits.sub_steps * limits.stride_mm),
      robot_kg_(plan.physics_settings().robot_mass_g / 1000),
      mover_of_(plan.movables(), kNone) {
  const double sub_step_s = plan.tick_length.seconds() / limits.sub_steps;
  for (const MovableBodyModel& body : bodies_)
    grip_mm_.push_back(body.friction * kGravity_m_s2 * 1000 * sub_step_s * sub_step_s / kInertia);
}

/// A gain for which the iteration is stable in any arrangement: below 1 over the sum, over a contact's two ends, of the
/// response of all contacts at that end to an impulse (Gershgorin). The sum is at most 4 at a robot.
double MovablePass::gain(std::uint32_t movable, std::size_t robots) const {
  const MovableBodyModel& body = bodies_[movable];
  const double lever = body.shape.reach_mm() / body.shape.mean_distance_mm();
  return 1 / (4 + robot_kg_ / body.mass_kg * static_cast<double>(robots) * (1 + lever * lever));
}

void MovablePass::clear() {
  for (const Mover& mover : movers_) mover_of_[mover.movable] = kNone;
  movers_.clear();
  links_.clear();
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

void MovablePass::move_points(const Mover& mover, const Motion& shift, const Motion& extrapolated,
                              double* (ContactPass::*of)(Slot), ContactPass& pass) const {
  const double rho_mm = bodies_[mover.movable].shape.mean_distance_mm();
  for (const Contact& c : mover.contacts) {
    double* const point = (pass.*of)(c.point);
    point[0] = shift.x_mm - c.lever_y_mm * (shift.turn_mm / rho_mm);
    point[1] = shift.y_mm + c.lever_x_mm * (shift.turn_mm / rho_mm);
    point[2] = extrapolated.x_mm - c.lever_y_mm * (extrapolated.turn_mm / rho_mm);
    point[3] = extrapolated.y_mm + c.lever_x_mm * (extrapolated.turn_mm / rho_mm);
  }
}

void MovablePass::start(const std::vector<MovableState>& states, ContactPass& pass) {
  for (Mover& mover : movers_) {
    const MovableState& state = states[mover.movable];
    mover.velocity = {state.vx_mm, state.vy_mm, state.turn_rad * bodies_[mover.movable].shape.mean_distance_mm()};
    find_stops(mover, states);
    move_points(mover, {}, mover.velocity, &ContactPass::start, pass);
  }
  find_links();
}

/// In the order of the bodies' indices, which is the same in all partitions.
void MovablePass::find_links() {
  for (std::uint32_t m = 0; m < mover_of_.size(); ++m) {
    if (mover_of_[m] == kNone) continue;
    Mover& first = movers_[mover_of_[m]];
    for (const Stop& s : first.stops) {
      if (s.other == kNone || mover_of_[s.other] == kNone) continue;
      first.linked = true;
      if (s.other < m) continue;  // Both bodies list the contact; the one with the lower index creates the link.
      const Mover& second = movers_[mover_of_[s.other]];
      links_.push_back({mover_of_[m], mover_of_[s.other], s.normal_x, s.normal_y,
                        arm(first, s.lever_x_mm, s.lever_y_mm, s.normal_x, s.normal_y),
                        arm(second, s.other_lever_x_mm, s.other_lever_y_mm, s.normal_x, s.normal_y), s.gap_mm});
    }
  }
}

void MovablePass::sub_step(std::uint32_t step, ContactPass& pass) {
  for (Mover& mover : movers_) {
    if (step < mover.passes) push(mover, pass);
  }
  balance(step);
  for (Mover& mover : movers_) {
    if (step < mover.passes) place(mover, pass);
  }
  for (Mover& mover : movers_) mover.shift = mover.next_shift;
}

/// Adds the impulses of robots.
void MovablePass::push(Mover& mover, const ContactPass& pass) const {
  const double share = robot_kg_ / bodies_[mover.movable].mass_kg;
  Motion force;
  for (Contact& c : mover.contacts) {
    // The same expressions as on the robot's side give the same bits.
    const double* const robot = pass.now(c.robot);
    const double* const point = pass.now(c.point);
    const double gap = c.gap_mm + (c.normal_x * (point[0] - robot[0]) + c.normal_y * (point[1] - robot[1]));
    const double closing = c.normal_x * (robot[2] - point[2]) + c.normal_y * (robot[3] - point[3]);
    c.normal_impulse_mm =
        std::max(c.normal_impulse_mm + c.gain * (closing - kEase * std::max(gap - touch_mm_, 0.0)), 0.0);
    force.x_mm += c.normal_impulse_mm * c.normal_x;
    force.y_mm += c.normal_impulse_mm * c.normal_y;
    force.turn_mm += c.normal_impulse_mm * arm(mover, c.lever_x_mm, c.lever_y_mm, c.normal_x, c.normal_y);
  }
  mover.before = mover.velocity;
  mover.velocity = {mover.before.x_mm + share * force.x_mm, mover.before.y_mm + share * force.y_mm,
                    mover.before.turn_mm + share * force.turn_mm};
  mover.braked = {};
}

/// Applies friction, walls, and forces between movable bodies.
void MovablePass::balance(std::uint32_t step) {
  for (Mover& mover : movers_) {
    if (step < mover.passes && !mover.linked) brake(mover);
  }
  if (links_.empty()) return;
  const auto add = [](Motion& v, const Link& link, double lever, double way) {
    v.x_mm += way * link.normal_x;
    v.y_mm += way * link.normal_y;
    v.turn_mm += way * lever;
  };
  for (Link& link : links_) link.push = 0;
  for (Mover& mover : movers_) mover.changed = true;
  // Without a change in a round, further rounds would change nothing.
  bool any = true;
  for (int round = 0; round < kBalanceRounds && any; ++round) {
    any = false;
    for (Link& link : links_) {
      Mover &a = movers_[link.first], &b = movers_[link.second];
      if (step >= a.passes || step >= b.passes) continue;
      const double gap = link.gap_mm - along(a.shift, link.normal_x, link.normal_y, link.first_arm) +
                         along(b.shift, link.normal_x, link.normal_y, link.second_arm);
      const double excess = along(a.velocity, link.normal_x, link.normal_y, link.first_arm) -
                            along(b.velocity, link.normal_x, link.normal_y, link.second_arm) -
                            std::max(gap - touch_mm_, 0.0);
      if (excess < kTolerance_mm && (excess > -kTolerance_mm || link.push == 0)) continue;
      const double of_a = 1 / bodies_[a.movable].mass_kg, of_b = 1 / bodies_[b.movable].mass_kg;
      const double yields =
          of_a * (1 + link.first_arm * link.first_arm) + of_b * (1 + link.second_arm * link.second_arm);
      const double push = std::max(link.push + kRelaxation * excess / yields, 0.0), more = push - link.push;
      link.push = push;
      add(a.velocity, link, link.first_arm, -of_a * more);
      add(b.velocity, link, link.second_arm, of_b * more);
      any = a.changed = b.changed = true;
    }
    for (Mover& mover : movers_) {
      if (step < mover.passes && mover.linked && mover.changed) brake(mover);
      mover.changed = false;
    }
    any |= round == 0;
  }
}

void MovablePass::remove_excess(Motion& m, double nx, double ny, double lever, double excess) {
  const double part = excess / (1 + lever * lever);
  m.x_mm -= part * nx;
  m.y_mm -= part * ny;
  m.turn_mm -= part * lever;
}

double MovablePass::gap_mm(const Mover& mover, const Stop& s) const {
  double gap = s.gap_mm - along(mover.shift, s.normal_x, s.normal_y,
                                arm(mover, s.lever_x_mm, s.lever_y_mm, s.normal_x, s.normal_y));
  if (s.other == kNone || mover_of_[s.other] == kNone) return gap;
  const Mover& other = movers_[mover_of_[s.other]];
  return gap + along(other.shift, s.normal_x, s.normal_y,
                     arm(other, s.other_lever_x_mm, s.other_lever_y_mm, s.normal_x, s.normal_y));
}

/// Allowed displacement along the normal: half of the gap towards a movable body, the whole gap otherwise.
double MovablePass::room_mm(const Mover& mover, const Stop& s) const {
  const double gap = gap_mm(mover, s);
  return std::max(s.other == kNone ? gap : gap / 2, 0.0);
}

/// The ground removes as much of the velocity as friction allows; walls and obstacles stop the rest.
void MovablePass::brake(Mover& mover) const {
  Motion v{mover.velocity.x_mm + mover.braked.x_mm, mover.velocity.y_mm + mover.braked.y_mm,
           mover.velocity.turn_mm + mover.braked.turn_mm};
  const Motion unbraked = v;
  const double length = __builtin_sqrt(v.x_mm * v.x_mm + v.y_mm * v.y_mm + v.turn_mm * v.turn_mm);
  const double grip = grip_mm_[mover.movable], keep = length > grip ? (length - grip) / length : 0;
  v = {v.x_mm * keep, v.y_mm * keep, v.turn_mm * keep};
  mover.braked = {unbraked.x_mm - v.x_mm, unbraked.y_mm - v.y_mm, unbraked.turn_mm - v.turn_mm};
  for (int round = 0; round < kRounds; ++round) {
    for (const Stop& s : mover.stops) {
      if (s.other != kNone && mover_of_[s.other] != kNone) continue;  // a link
      const double lever = arm(mover, s.lever_x_mm, s.lever_y_mm, s.normal_x, s.normal_y);
      const double excess = along(v, s.normal_x, s.normal_y, lever) - room_mm(mover, s);
      if (excess > kTolerance_mm) remove_excess(v, s.normal_x, s.normal_y, lever, excess);
    }
  }
  mover.velocity = v;
}

/// Computes the displacement: at most half of each gap towards robots and other movable bodies.
void MovablePass::place(Mover& mover, ContactPass& pass) const {
  const MovableBodyModel& body = bodies_[mover.movable];
  const double rho_mm = body.shape.mean_distance_mm();
  const auto lever = [&](const auto& c) { return arm(mover, c.lever_x_mm, c.lever_y_mm, c.normal_x, c.normal_y); };
  const Motion &v = mover.velocity, &before = mover.before;
  const Motion extrapolated{(v.x_mm + v.x_mm) - before.x_mm, (v.y_mm + v.y_mm) - before.y_mm,
                            (v.turn_mm + v.turn_mm) - before.turn_mm};
  Motion way = v;
  const auto half_gap = [&](const Contact& c) {
    const double* const robot = pass.now(c.robot);
    const double* const point = pass.now(c.point);
    const double gap = c.gap_mm + (c.normal_x * (point[0] - robot[0]) + c.normal_y * (point[1] - robot[1]));
    return std::max(gap / 2, 0.0);
  };
  for (int round = 0; round < kRounds; ++round) {
    for (const Contact& c : mover.contacts) {
      const double excess = -along(way, c.normal_x, c.normal_y, lever(c)) - half_gap(c);
      if (excess > kTolerance_mm) remove_excess(way, -c.normal_x, -c.normal_y, -lever(c), excess);
    }
    for (const Stop& s : mover.stops) {
      const double excess = along(way, s.normal_x, s.normal_y, lever(s)) - room_mm(mover, s);
      if (excess > kTolerance_mm) remove_excess(way, s.normal_x, s.normal_y, lever(s), excess);
    }
  }
  double scale = 1;
  const auto hold = [&](double closing, double limit) {
    if (closing > limit + kTolerance_mm && scale * closing > limit) scale = limit / closing;
  };
  for (const Contact& c : mover.contacts) hold(-along(way, c.normal_x, c.normal_y, lever(c)), half_gap(c));
  for (const Stop& s : mover.stops) hold(along(way, s.normal_x, s.normal_y, lever(s)), room_mm(mover, s));
  const double turn = way.turn_mm < 0 ? -way.turn_mm : way.turn_mm;
  const double farthest =
      __builtin_sqrt(way.x_mm * way.x_mm + way.y_mm * way.y_mm) + turn * (body.shape.reach_mm() / rho_mm);
  if (scale * farthest > stride_mm_) scale = stride_mm_ / farthest;
  mover.next_shift = {mover.shift.x_mm + scale * way.x_mm, mover.shift.y_mm + scale * way.y_mm,
                      mover.shift.turn_mm + scale * way.turn_mm};
  move_points(mover, mover.next_shift, extrapolated, &ContactPass::after, pass);
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

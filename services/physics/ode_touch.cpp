// Contacts of bodies with the floor, walls, obstacles and each other.
#include "services/physics/ode_engine.hpp"

#include <algorithm>

namespace kilotwin::physics {
namespace {

/// Above this speed, friction acts against the velocity; below it, against the slope.
constexpr double kSlidingSpeed_mm_s = 0.1;
/// Number of rim points on which a cylinder stands, and their x coordinates for radius 1.
constexpr std::size_t kRimPoints = 8;
constexpr double kRimX[kRimPoints] = {1,  0.70710678118654752,  0, -0.70710678118654752,
                                      -1, -0.70710678118654752, 0, 0.70710678118654752};

}  // namespace

void OdeEngine::touch_floor(std::uint32_t i) {
  const RigidState& state = now_[i];
  const Axes axes(state.rotation);
  const Vector3 ahead = level(axes.x[0], axes.x[1], start_axis_[i]);
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = TouchPoint::kStanding;
  touch.normal = {0, 0, 1};
  if (drive_of_[i] != kUndriven) return touch_floor_driven(touch, i, ahead, drive_of_[i]);

  const Kind& body = kind(i);
  const double speed_x = state.velocity_mm_s[0], speed_y = state.velocity_mm_s[1];
  const bool slides = speed_x * speed_x + speed_y * speed_y > kSlidingSpeed_mm_s * kSlidingSpeed_mm_s;
  touch.friction = TouchPoint::Friction::kCoulomb;
  touch.grip[0] = touch.grip[1] = body.friction;
  touch.axis = slides ? level(speed_x, speed_y, ahead) : body.holds_on_slope && !is_robot(i) ? ahead : downhill_;
  const auto stand = [&](const Vector3& point) {
    const Vector3 arm = axes.to_arena(point);
    for (std::size_t k = 0; k < 3; ++k) touch.at_mm[k] = state.position_mm[k] + arm[k];
    touch.gap_mm = touch.at_mm[2];
    world_.add(touch);
  };
  const double below_mm = -body.height_mm / 2;
  if (is_robot(i)) {
    for (const Vector3& leg : legs_mm_) stand(leg);
  } else if (body.shape.is_disc()) {
    const double radius_mm = body.shape.radius_mm();
    for (std::size_t k = 0; k < kRimPoints; ++k)
      stand({radius_mm * kRimX[k], radius_mm * kRimX[(k + 6) % kRimPoints], below_mm});
  } else {
    for (const Point2 corner : body.shape.corners()) stand({corner.x_mm, corner.y_mm, below_mm});
  }
}

void OdeEngine::touch_floor_driven(TouchPoint& touch, std::uint32_t i, const Vector3& ahead, std::uint32_t d) {
  const RigidState& state = now_[i];
  const Axes axes(state.rotation);
  // The drive's displacement within a sub-step refers to the heading at the tick's start.
  const Vector3& start = start_axis_[i];
  const double cosine = start[0] * ahead[0] + start[1] * ahead[1], sine = start[0] * ahead[1] - start[1] * ahead[0];
  const double velocity_x = (cosine * drives_.x_mm[d] - sine * drives_.y_mm[d]) / limits_.sub_step_s;
  const double velocity_y = (sine * drives_.x_mm[d] + cosine * drives_.y_mm[d]) / limits_.sub_step_s;
  const double spin = drives_.turn_rad[d] / (limits_.sub_step_s * limits_.sub_steps);
  touch.friction = TouchPoint::Friction::kBounded;
  touch.axis = ahead;
  for (std::size_t leg = 0; leg < legs_mm_.size(); ++leg) {
    const Vector3 arm = axes.to_arena(legs_mm_[leg]);
    for (std::size_t k = 0; k < 3; ++k) touch.at_mm[k] = state.position_mm[k] + arm[k];
    touch.gap_mm = touch.at_mm[2];
    // The rear legs push along their direction of travel. They lie on the axle, so one of them holds the robot sideways for
    // both. Together with the front leg it keeps the robot from turning.
    touch.grip[0] = leg < 2 ? thrust_g_mm_s2_ / 2 : 0;
    touch.grip[1] = leg == 0 ? thrust_g_mm_s2_ * 2 / 3 : leg == 2 ? thrust_g_mm_s2_ / 3 : 0;
    const double x = velocity_x - spin * arm[1], y = velocity_y + spin * arm[0];
    touch.motion_mm_s[0] = x * ahead[0] + y * ahead[1];
    touch.motion_mm_s[1] = y * ahead[0] - x * ahead[1];
    world_.add(touch);
  }
}

/// Adds a contact at the height that the touch point has.
void OdeEngine::add_touch(TouchPoint& touch, double x_mm, double y_mm, double normal_x, double normal_y,
                          double gap_mm) {
  if (gap_mm > limits_.reach_mm) return;
  touch.at_mm[0] = x_mm;
  touch.at_mm[1] = y_mm;
  touch.normal = {normal_x, normal_y, 0};
  touch.axis = {0, 0, 1};
  touch.gap_mm = gap_mm;
  world_.add(touch);
}

void OdeEngine::touch_walls(std::uint32_t i) {
  const Place here = place(i);
  const Convex& shape = kind(i).shape;
  // Most bodies are far from all walls.
  if (scene_.arena.clearance_mm({here.x_mm, here.y_mm}) > shape.reach_mm() + limits_.reach_mm) return;
  if (shape.is_disc()) return touch_wall(i, {here.x_mm, here.y_mm}, shape.radius_mm());
  for (const Point2 corner : shape.corners()) touch_wall(i, here.to_arena(corner), 0);
}

void OdeEngine::touch_wall(std::uint32_t i, Point2 at, double radius_mm) {
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = TouchPoint::kStanding;
  touch.at_mm[2] = kind(i).height_mm / 2;
  const ArenaShape& arena = scene_.arena;
  const auto wall = [&](double out_x, double out_y, double gap_mm) {
    add_touch(touch, at.x_mm + out_x * radius_mm, at.y_mm + out_y * radius_mm, -out_x, -out_y, gap_mm - radius_mm);
  };
  switch (arena.kind()) {
    case ArenaShape::Kind::kRectangle:
      wall(1, 0, arena.half_width_mm() - at.x_mm);
      wall(-1, 0, arena.half_width_mm() + at.x_mm);
      wall(0, 1, arena.half_height_mm() - at.y_mm);
      wall(0, -1, arena.half_height_mm() + at.y_mm);
      return;
    case ArenaShape::Kind::kCircle: {
      const Vector3 out = level(at.x_mm, at.y_mm, {1, 0, 0});
      wall(out[0], out[1], arena.clearance_mm(at));
      return;
    }
    case ArenaShape::Kind::kPolygon:
      for (std::size_t e = 0; e < arena.normals().size(); ++e) {
        const Point2 n = arena.normals()[e], corner = arena.corners()[e];
        wall(n.x_mm, n.y_mm, n.x_mm * (corner.x_mm - at.x_mm) + n.y_mm * (corner.y_mm - at.y_mm));
      }
  }
}

void OdeEngine::touch_obstacles(std::uint32_t i) {
  const Place here = place(i);
  const Kind& body = kind(i);
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = TouchPoint::kStanding;
  for (const ObstacleBody& obstacle : scene_.obstacles) {
    const double dx = obstacle.place.x_mm - here.x_mm, dy = obstacle.place.y_mm - here.y_mm;
    const double near_mm = obstacle.shape.reach_mm() + body.shape.reach_mm() + limits_.reach_mm;
    if (dx * dx + dy * dy > near_mm * near_mm) continue;
    touch.at_mm[2] = std::min(body.height_mm, obstacle.height_mm) / 2;
    touch_shapes(touch, body.shape, here, obstacle.shape, obstacle.place);
  }
}

void OdeEngine::touch_robots(std::uint32_t i, double since_s) {
  for (const std::uint32_t j : candidates_.of(i)) {
    if (not_simulated_[j] == 0 && (j < i || leader_[j] != leader_[i])) continue;
    touch_pair(i, j, since_s);
  }
}

/// Body i is simulated; body j may be immobile.
void OdeEngine::touch_pair(std::uint32_t i, std::uint32_t j, double since_s) {
  TouchPoint touch;
  touch.body = in_world_[i];
  touch.other = not_simulated_[j] != 0 ? TouchPoint::kStanding : in_world_[j];
  touch.at_mm[2] = std::min(kind(i).height_mm, kind(j).height_mm) / 2;
  const Place here = place(i);
  Place there = place(j);
  if (not_simulated_[j] != 0) {
    there.x_mm += now_[j].velocity_mm_s[0] * since_s;
    there.y_mm += now_[j].velocity_mm_s[1] * since_s;
  }
  const Convex &a = kind(i).shape, &b = kind(j).shape;
  if (a.is_disc() && b.is_disc()) {
    const double dx = here.x_mm - there.x_mm, dy = here.y_mm - there.y_mm;
    const double gap_mm = __builtin_sqrt(dx * dx + dy * dy) - a.radius_mm() - b.radius_mm();
    // Two bodies at the same position separate along x, the lower index to the left.
    const Vector3 normal = level(dx, dy, {i < j ? -1.0 : 1.0, 0, 0});
    const double from_mm = b.radius_mm() + gap_mm / 2;
    return add_touch(touch, there.x_mm + normal[0] * from_mm, there.y_mm + normal[1] * from_mm, normal[0],
                     normal[1], gap_mm);
  }
  touch_shapes(touch, a, here, b, there);
}

/// Possible contacts of the touch point's body with the other: corners near faces, both ways, and centres of discs.
void OdeEngine::touch_shapes(TouchPoint& touch, const Convex& body, const Place& here, const Convex& other,
                             const Place& there) {
  const auto near_other = [&](Point2 p, double radius_mm) {
    const Nearest nearest = other.nearest(there, p);
    add_touch(touch, nearest.at.x_mm, nearest.at.y_mm, nearest.normal_x, nearest.normal_y,
              nearest.distance_mm - radius_mm);
  };
  const auto near_body = [&](Point2 p, double radius_mm) {
    const Nearest nearest = body.nearest(here, p);
    add_touch(touch, nearest.at.x_mm, nearest.at.y_mm, -nearest.normal_x, -nearest.normal_y,
              nearest.distance_mm - radius_mm);
  };
  if (body.is_disc()) return near_other({here.x_mm, here.y_mm}, body.radius_mm());
  if (other.is_disc()) return near_body({there.x_mm, there.y_mm}, other.radius_mm());
  for (const Point2 corner : body.corners()) near_other(here.to_arena(corner), 0);
  for (const Point2 corner : other.corners()) near_body(there.to_arena(corner), 0);
}

}  // namespace kilotwin::physics

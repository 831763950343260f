// Contacts of robots with movable bodies, obstacles, and walls that are not straight.
#include <algorithm>

#include "services/physics/contact.hpp"

namespace kilotwin::physics {

void ContactSolver::find_specials(const Bodies& bodies) {
  specials_.clear();
  for (auto& touching : touching_) touching.clear();
  const bool straight = world_.arena.kind() == ArenaShape::Kind::kRectangle;
  if (straight && world_.obstacles.empty() && world_.movables.empty()) return;
  const auto count = static_cast<std::uint32_t>(bodies.size());
  const auto robots = static_cast<std::uint32_t>(cache_.size());
  const auto movables = static_cast<std::uint32_t>(movables_.size());
  has_special_.assign(count, 0);
  const double near_mm = limits_.cutoff_mm - kRobotRadius_mm;  // from a robot's centre to a shape's rim
  const auto with_shape = [&](const Convex& shape, const Place& place, std::uint32_t key, std::uint32_t movable) {
    const double far_mm = shape.reach_mm() + near_mm;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double dx = bodies.x_mm[i] - place.x_mm, dy = bodies.y_mm[i] - place.y_mm;
      if (dx > far_mm || dx < -far_mm || dy > far_mm || dy < -far_mm || dx * dx + dy * dy > far_mm * far_mm)
        continue;
      add_special(i, key, movable, shape.nearest(place, {bodies.x_mm[i], bodies.y_mm[i]}));
    }
  };
  for (std::uint32_t m = 0; m < movables; ++m) {
    with_shape(world_.movables[m].shape, Place::at(movables_[m].x_mm, movables_[m].y_mm, movables_[m].heading_rad),
               robots + m, m);
  }
  for (std::uint32_t k = 0; k < world_.obstacles.size(); ++k)
    with_shape(world_.obstacles[k].shape, world_.obstacles[k].place, robots + movables + k, kNone);
  if (!straight) {
    const auto walls = robots + movables + static_cast<std::uint32_t>(world_.obstacles.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const double x = bodies.x_mm[i], y = bodies.y_mm[i];
      if (world_.arena.clearance_mm({x, y}) > near_mm) continue;
      if (world_.arena.kind() == ArenaShape::Kind::kCircle) {
        const double r = __builtin_sqrt(x * x + y * y);
        add_special(i, walls, kNone, {-x / r, -y / r, world_.arena.radius_mm() - r, {}});
        continue;
      }
      for (std::uint32_t e = 0; e < world_.arena.corners().size(); ++e) {
        const Point2 n = world_.arena.normals()[e], c = world_.arena.corners()[e];
        add_special(i, walls + e, kNone, {-n.x_mm, -n.y_mm, n.x_mm * (c.x_mm - x) + n.y_mm * (c.y_mm - y), {}});
      }
    }
  }
  std::sort(specials_.begin(), specials_.end(), [](const Special& a, const Special& b) {
    return a.body != b.body ? a.body < b.body : a.key < b.key;  // No two contacts compare equal.
  });
  for (std::uint32_t k = 0; k < specials_.size(); ++k) {
    if (specials_[k].movable != kNone) touching_[specials_[k].movable].push_back(k);
  }
  for (std::uint32_t m = 0; m < movables; ++m) {
    movable_in_motion_[m] = movables_[m].moves();
    const double gain = movable_pass_.gain(m, touching_[m].size());
    for (const std::uint32_t k : touching_[m]) {
      specials_[k].gain = gain;
      movable_in_motion_[m] |= in_motion_[specials_[k].body];
    }
  }
  // Movable bodies that may touch each other, directly or through others, pass motion on to all of them.
  std::vector<std::uint32_t>& next = reached_;
  next.clear();
  for (std::uint32_t m = 0; m < movables; ++m) {
    if (movable_in_motion_[m] != 0) next.push_back(m);
  }
  while (!next.empty()) {
    const std::uint32_t m = next.back();
    next.pop_back();
    movable_pass_.for_each_near(m, movables_, [&](std::uint32_t other) {
      if (movable_in_motion_[other] != 0) return;
      movable_in_motion_[other] = 1;
      next.push_back(other);
    });
  }
}

void ContactSolver::add_special(std::uint32_t body, std::uint32_t key, std::uint32_t movable,
                                const Nearest& of_shape) {
  Special special{
      body, key, movable, -of_shape.normal_x, -of_shape.normal_y, of_shape.distance_mm - kRobotRadius_mm, kGain,
      0,    0,   0,       ContactPass::kStill};
  if (special.gap_mm > limits_.cutoff_mm - kDiameter_mm) return;
  if (movable != kNone) {
    special.lever_x_mm = of_shape.at.x_mm - movables_[movable].x_mm;
    special.lever_y_mm = of_shape.at.y_mm - movables_[movable].y_mm;
  }
  has_special_[body] = 1;
  specials_.push_back(special);
}

std::pair<const ContactSolver::Special*, const ContactSolver::Special*> ContactSolver::specials_of(
    std::uint32_t body) const {
  if (specials_.empty() || has_special_[body] == 0) return {nullptr, nullptr};
  const auto begin = std::lower_bound(specials_.begin(), specials_.end(), body,
                                      [](const Special& s, std::uint32_t b) { return s.body < b; });
  auto end = begin;
  while (end != specials_.end() && end->body == body) ++end;
  return {&*begin, &*begin + (end - begin)};
}

void ContactSolver::fill_specials(std::size_t lane, const Mover& mover, ContactBatch& batch) {
  const auto count = static_cast<std::uint32_t>(active_.size());
  SpecialLanes* const laws = pass_.specials_of(batch);
  ContactLanes* const contacts = pass_.contacts_of(batch);
  const auto discs = static_cast<std::uint32_t>(batch.discs[lane]);
  for (std::uint32_t q = 0; q < batch.contacts; ++q) {
    laws[q].gain[lane] = kGain;
    laws[q].friction[lane] = q < discs ? limits_.rim_friction : 0;
  }
  for (std::uint32_t p = discs; p < mover.contacts; ++p) {
    const Special& special = specials_[others_[mover.first + p] - count];
    ContactLanes& contact = contacts[p];
    contact.normal_x[lane] = special.normal_x;
    contact.normal_y[lane] = special.normal_y;
    contact.gap_mm[lane] = special.gap_mm;
    contact.normal_impulse_mm[lane] = special.normal_impulse_mm;
    contact.tangent_impulse_mm[lane] = contact.spin_mm[lane] = 0;
    contact.other[lane] = special.slot;
    laws[p].gain[lane] = special.gain;
  }
}

}  // namespace kilotwin::physics

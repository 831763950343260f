#include "services/physics/contact.hpp"

#include <algorithm>

namespace kilotwin::physics {
namespace {

constexpr double kDiameter_mm = 2 * kRobotRadius_mm;
constexpr double kOverlapSquare_mm2 = (kDiameter_mm - kOverlapTolerance_mm) * (kDiameter_mm - kOverlapTolerance_mm);

/// Where a lane has no contact: so far away that it never acts.
constexpr double kNoContact_mm = 1e100;

/// Of contacts of discs. Six discs around one, each with six, are stable below 1/6: the sum of n n^T over six normals has the
/// eigenvalue 3, a contact has two ends, and the masses are the unit.
constexpr double kGain = 0.15;

}  // namespace

ContactLimits::ContactLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.experiment().physics().sub_steps(), 1u, 4u)) {
  const double steps = sub_steps;
  const double sub_step_s = plan.tick_length.seconds() / steps;
  separation_mm = kSeparation_mm_s * sub_step_s;
  stride_mm = std::max(separation_mm, drive.top_speed_mm_s() * sub_step_s);
  // A pair closes by at most 2 strides in a sub-step.
  cutoff_mm = kDiameter_mm + 2 * steps * stride_mm;
  // A hop per sub-step, and the way of a body that leaves the rectangle in this tick.
  margin_mm = steps * cutoff_mm + steps * stride_mm;
  x_limit_mm = plan.world.arena.half_width_mm() - kRobotRadius_mm;
  y_limit_mm = plan.world.arena.half_height_mm() - kRobotRadius_mm;
  touch_mm = 2 * stride_mm;
  const proto::Physics& physics = plan.experiment().physics();
  // What an acceleration of the true mass adds to a velocity in a sub-step.
  const double mm_per_m_s2 = 1000 * sub_step_s * sub_step_s / kInertia;
  thrust_mm = physics.thrust_n() / (physics.robot_mass_g() / 1000) * mm_per_m_s2;
  rim_friction = physics.rim_friction();
  hold_mm = physics.robot_friction() * kGravity_m_s2 * mm_per_m_s2;
}

bool ContactLimits::outside(double x_mm, double y_mm) const {
  return x_mm > x_limit_mm || x_mm < -x_limit_mm || y_mm > y_limit_mm || y_mm < -y_limit_mm;
}

ContactSolver::ContactSolver(const RunPlan& plan, const DriveModel& drive)
    : limits_(plan, drive),
      sub_step_part_(1.0 / limits_.sub_steps),
      candidates_(limits_.cutoff_mm),
      world_(plan.world),
      immobile_(plan.robots()),
      presses_(plan.robots()),
      movable_pass_(plan, limits_),
      touching_(plan.movables()),
      lively_movable_(plan.movables()) {
  for (std::uint32_t r = 0; r < plan.robots(); ++r) immobile_[r] = plan.immobile(r);
  for (const MovableBodyModel& body : world_.movables) {
    movables_.push_back({body.pose.position_mm.x(), body.pose.position_mm.y(), body.pose.heading_rad, 0, 0, 0});
  }
}

bool ContactSolver::find(const Bodies& bodies, const std::vector<std::uint8_t>& own,
                         const std::vector<std::uint8_t>& own_movable, const std::vector<std::uint8_t>& driven) {
  const auto count = static_cast<std::uint32_t>(bodies.size());
  const auto movables = static_cast<std::uint32_t>(movables_.size());
  driven_.resize(count);
  active_.resize(count);
  lively_.resize(count);
  int any_active = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    driven_[i] = driven[i] != 0 && immobile_[bodies.robot[i]] == 0;
    active_[i] = driven_[i] | bodies.awake[i];
    lively_[i] = driven_[i] | presses_[bodies.robot[i]].any();
    any_active |= active_[i];
  }
  for (const MovableState& body : movables_) any_active |= body.moves();
  if (any_active == 0) return false;

  candidates_.update(bodies);
  find_specials(bodies);
  has_others_ = !own.empty();
  hops_.assign(count + movables, 0);
  for (std::uint32_t i = 0; i < own.size(); ++i) hops_[i] = own[i] != 0 ? 0 : kOutOfReach;
  for (std::uint32_t m = 0; m < movables && has_others_; ++m)
    hops_[count + m] = own_movable[m] != 0 ? 0 : kOutOfReach;
  overlaps_.assign(count, 0);
  seat_of_.assign(count, ContactPass::kStill);
  movers_.clear();
  reached_.clear();
  movable_pass_.clear();
  other_count_ = 0;
  any_overlap_ = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (hops_[i] == 0 && may_be_touched(i)) search(bodies, i);
  }
  for (std::uint32_t m = 0; m < movables; ++m) {
    if (hops_[count + m] == 0) search_movable(m);
  }
  for (std::size_t k = 0; k < reached_.size(); ++k) {
    const std::uint32_t i = reached_[k];
    if (hops_[i] < limits_.sub_steps) {
      i < count ? search(bodies, i) : search_movable(i - count);
    } else if (i < count ? lively_[i] != 0 : lively_movable_[i - count] != 0) {
      // Its velocity at the tick's start counts.
      if (i < count) {
        movers_.push_back({i, 0, 0});
      } else {
        movable_pass_.add(i - count, 0);
      }
    }
  }
  seat_movers();
  return true;
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

void ContactSolver::find_specials(const Bodies& bodies) {
  specials_.clear();
  for (auto& touching : touching_) touching.clear();
  const bool straight = world_.arena.kind() == ArenaShape::Kind::kRectangle;
  if (straight && world_.obstacles.empty() && world_.movables.empty()) return;
  const auto count = static_cast<std::uint32_t>(bodies.size());
  const auto robots = static_cast<std::uint32_t>(presses_.size());
  const auto movables = static_cast<std::uint32_t>(movables_.size());
  has_special_.assign(count, 0);
  const double near_mm = limits_.cutoff_mm - kRobotRadius_mm;  // of a centre, from a rim
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
    return a.body != b.body ? a.body < b.body : a.key < b.key;  // No two are equal.
  });
  for (std::uint32_t k = 0; k < specials_.size(); ++k) {
    if (specials_[k].movable != kNone) touching_[specials_[k].movable].push_back(k);
  }
  for (std::uint32_t m = 0; m < movables; ++m) {
    lively_movable_[m] = movables_[m].moves();
    const double gain = movable_pass_.gain(m, touching_[m].size());
    for (const std::uint32_t k : touching_[m]) {
      specials_[k].gain = gain;
      lively_movable_[m] |= lively_[specials_[k].body];
    }
  }
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

/// A sleeping body stays so unless somebody beside it is driven, moved or overlaps.
bool ContactSolver::may_be_touched(std::uint32_t i) const {
  if (active_[i] != 0) return true;
  for (const std::uint32_t j : candidates_.of(i)) {
    if (active_[j] != 0) return true;
  }
  const auto [begin, end] = specials_of(i);
  return std::any_of(begin, end,
                     [&](const Special& s) { return s.movable != kNone && lively_movable_[s.movable] != 0; });
}

void ContactSolver::reach(std::uint32_t node, std::uint8_t hops) {
  if (hops_[node] != kOutOfReach) return;
  hops_[node] = hops;
  reached_.push_back(node);
}

void ContactSolver::search_movable(std::uint32_t m) {
  if (lively_movable_[m] == 0) return;
  const auto count = static_cast<std::uint32_t>(active_.size());
  movable_pass_.add(m, limits_.sub_steps - hops_[count + m]);
  if (!has_others_) return;
  const auto next = static_cast<std::uint8_t>(hops_[count + m] + 1);
  for (const std::uint32_t k : touching_[m]) reach(specials_[k].body, next);
  movable_pass_.for_each_near(m, movables_, [&](std::uint32_t other) { reach(count + other, next); });
}

void ContactSolver::search(const Bodies& bodies, std::uint32_t i) {
  const double x = bodies.x_mm[i], y = bodies.y_mm[i], cutoff_square_mm2 = limits_.cutoff_mm * limits_.cutoff_mm;
  const auto candidates = candidates_.of(i);
  const auto [special, special_end] = specials_of(i);
  const std::size_t first = other_count_,
                    room = candidates.size() + static_cast<std::size_t>(special_end - special) + 1;
  if (others_.size() < first + room) others_.resize(2 * (first + room));
  std::uint32_t* const others = others_.data() + first;
  std::uint32_t contacts = 0;
  int overlaps = 0, beside_lively = lively_[i];
  for (const std::uint32_t j : candidates) {
    const double dx = bodies.x_mm[j] - x, dy = bodies.y_mm[j] - y, square = dx * dx + dy * dy;
    const int within = square <= cutoff_square_mm2;
    others[contacts] = j;
    contacts += static_cast<std::uint32_t>(within);
    overlaps |= square < kOverlapSquare_mm2;
    beside_lively |= within & lively_[j];
  }
  const std::uint32_t discs = contacts, count = static_cast<std::uint32_t>(bodies.size());
  for (const Special* s = special; s != special_end; ++s) {
    others[contacts++] = count + static_cast<std::uint32_t>(s - specials_.data());
    overlaps |= s->gap_mm < -kOverlapTolerance_mm;
    beside_lively |= s->movable != kNone && lively_movable_[s->movable] != 0;
  }
  overlaps_[i] = static_cast<std::uint8_t>(overlaps);
  if (contacts == 0 || bodies.tracked[i] != 0 || immobile_[bodies.robot[i]] != 0) return;
  if ((overlaps | beside_lively) == 0 && !limits_.outside(x, y)) return;
  any_overlap_ |= overlaps != 0;
  movers_.push_back({i, static_cast<std::uint32_t>(first), contacts});
  other_count_ = first + contacts;
  if (!has_others_) return;
  const auto next = static_cast<std::uint8_t>(hops_[i] + 1);
  for (std::uint32_t p = 0; p < discs; ++p) reach(others[p], next);
  for (const Special* s = special; s != special_end; ++s) {
    if (s->movable != kNone) reach(count + s->movable, next);
  }
}

void ContactSolver::seat_movers() {
  // By the number of contacts, so that lanes have work alike; those with equally many stay in the order of hops.
  std::array<std::uint32_t, kMostContacts + 2> end{};
  const auto key = [](const Mover& m) { return std::min(m.contacts, kMostContacts); };
  for (const Mover& m : movers_) ++end[key(m) + 1];
  for (std::size_t k = 1; k < end.size(); ++k) end[k] += end[k - 1];
  seated_.resize(movers_.size());
  for (const Mover& m : movers_) seated_[end[key(m)]++] = m;

  pass_.clear();
  for (std::size_t at = 0; at < seated_.size(); at += kLanes) {
    const std::size_t size = std::min(kLanes, seated_.size() - at);
    std::uint32_t contacts = 0, hops = limits_.sub_steps;
    for (std::size_t lane = 0; lane < size; ++lane) {
      contacts = std::max(contacts, seated_[at + lane].contacts);
      hops = std::min<std::uint32_t>(hops, hops_[seated_[at + lane].body]);
    }
    pass_.add_batch(contacts, limits_.sub_steps - hops);
    for (std::size_t lane = 0; lane < size; ++lane) seat_of_[seated_[at + lane].body] = pass_.seat(lane);
  }
  // The touched points of movable bodies have seats of their own; nothing but their body moves them.
  std::size_t lane = kLanes;
  for (Special& special : specials_) {
    if (special.movable == kNone || !movable_pass_.has(special.movable)) continue;
    if (lane == kLanes) {
      pass_.add_batch(0, 0);
      lane = 0;
    }
    special.seat = pass_.seat(lane++);
  }
  pass_.rest();
}

/// Forces of the contact of this body with another at the tick's start. Both keep it, unless one has come to be pressed only
/// in the last tick.
ContactSolver::Forces ContactSolver::forces_of(const Bodies& bodies, std::uint32_t i, std::uint32_t j) const {
  const Press& press = presses_[bodies.robot[i]];
  if (press.contacts != 0) return {press.push_of(bodies.robot[j]), press.rub_of(bodies.robot[j])};
  const Press& theirs = presses_[bodies.robot[j]];
  if (theirs.contacts == 0) return {};
  return {theirs.push_of(bodies.robot[i]), theirs.rub_of(bodies.robot[i])};
}

void ContactSolver::fill_contacts(const Bodies& bodies) {
  const double way_mm = limits_.sub_steps * limits_.stride_mm;
  const double x_free_mm = limits_.x_limit_mm - way_mm, y_free_mm = limits_.y_limit_mm - way_mm;
  for (std::size_t at = 0; at < seated_.size(); at += kLanes) {
    ContactPass::Batch& batch = pass_.batch_of(seat_of_[seated_[at].body]);
    const std::size_t size = std::min(kLanes, seated_.size() - at);
    Mover movers[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const bool filled = lane < size;
      movers[lane] = filled ? seated_[at + lane] : Mover{seated_[at].body, 0, 0};  // The last batch is filled up.
      const std::uint32_t i = movers[lane].body;
      const double x = bodies.x_mm[i], y = bodies.y_mm[i];
      const Press& press = presses_[bodies.robot[i]];
      batch.x_mm[lane] = x;
      batch.y_mm[lane] = y;
      batch.slip_x_mm[lane] = filled ? press.slip_x_mm : 0;
      batch.slip_y_mm[lane] = filled ? press.slip_y_mm : 0;
      batch.grip_mm[lane] = driven_[i] != 0 ? limits_.thrust_mm : limits_.hold_mm;
      batch.near_wall |= x > x_free_mm || x < -x_free_mm || y > y_free_mm || y < -y_free_mm;
    }
    fill_contacts(bodies, batch, movers);
  }
  pass_.set_off();
}

void ContactSolver::fill_contacts(const Bodies& bodies, const ContactPass::Batch& batch, const Mover* movers) {
  const auto count = static_cast<std::uint32_t>(bodies.size());
  std::uint32_t here[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) here[lane] = movers[lane].body;
  const Lanes x = gather(bodies.x_mm.data(), here), y = gather(bodies.y_mm.data(), here);
  ContactPass::Contact* const contacts = pass_.contacts_of(batch);
  for (std::uint32_t p = 0; p < batch.contacts; ++p) {
    std::uint32_t there[kLanes], entry[kLanes];
    double push[kLanes], rub[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      entry[lane] = p < movers[lane].contacts ? others_[movers[lane].first + p] : here[lane];
      there[lane] = entry[lane] < count ? entry[lane] : here[lane];
      const Forces forces = there[lane] != here[lane] ? forces_of(bodies, here[lane], there[lane]) : Forces{};
      push[lane] = forces.push_mm;
      rub[lane] = forces.rub_mm;
    }
    const Lanes dx = gather(bodies.x_mm.data(), there) - x, dy = gather(bodies.y_mm.data(), there) - y;
    const Lanes distance = root(dx * dx + dy * dy), inverse = all(1) / distance;
    ContactPass::Contact& contact = contacts[p];
    contact.normal_x = dx * inverse;
    contact.normal_y = dy * inverse;
    contact.gap_mm = distance - all(kDiameter_mm);
    contact.push_mm = load(push);
    contact.gain = all(kGain);
    contact.rub_mm = load(rub);
    contact.friction = all(limits_.rim_friction);
    for (std::size_t lane = 0; lane < kLanes; ++lane) contact.other[lane] = seat_of_[there[lane]];
    if (!(smallest(distance) > 0)) fill_special(contact, distance, here, there, entry);
  }
}

/// Bodies in the same place, contacts with what is no disc, and lanes that have no such contact.
void ContactSolver::fill_special(ContactPass::Contact& contact, const Lanes& distance_mm, const std::uint32_t* here,
                                 const std::uint32_t* there, const std::uint32_t* entry) const {
  double distance[kLanes], gap[kLanes], normal_x[kLanes], normal_y[kLanes], push[kLanes], gain[kLanes],
      friction[kLanes];
  store(distance_mm, distance);
  store(contact.gap_mm, gap);
  store(contact.normal_x, normal_x);
  store(contact.normal_y, normal_y);
  store(contact.push_mm, push);
  store(contact.gain, gain);
  store(contact.friction, friction);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (distance[lane] > 0) continue;
    if (entry[lane] != there[lane]) {
      const Special& special = specials_[entry[lane] - static_cast<std::uint32_t>(active_.size())];
      normal_x[lane] = special.normal_x;
      normal_y[lane] = special.normal_y;
      gap[lane] = special.gap_mm;
      gain[lane] = special.gain;
      friction[lane] = 0;
      push[lane] = special.push_mm;
      contact.other[lane] = special.seat;
      continue;
    }
    // Two in the same place part along x, the lower id to the left.
    normal_x[lane] = there[lane] < here[lane] ? -1 : 1;
    normal_y[lane] = 0;
    if (there[lane] != here[lane]) continue;
    contact.other[lane] = ContactPass::kStill;
    gap[lane] = kNoContact_mm;
  }
  contact.gap_mm = load(gap);
  contact.normal_x = load(normal_x);
  contact.normal_y = load(normal_y);
  contact.push_mm = load(push);
  contact.gain = load(gain);
  contact.friction = load(friction);
}

void ContactSolver::move(Bodies& bodies, const Drives& drives) {
  for (Special& special : specials_) special.push_mm = presses_[bodies.robot[special.body]].push_of(special.key);
  for (std::size_t d = 0; d < drives.count; ++d) {
    const std::uint32_t i = drives.body[d];
    const ContactPass::Seat seat = seat_of_[i];
    if (seat == ContactPass::kStill) {
      move_alone(bodies, i, drives.x_mm[d], drives.y_mm[d]);
    } else {
      ContactPass::Batch& batch = pass_.batch_of(seat);
      const std::size_t lane = ContactPass::lane_of(seat);
      batch.cos_turn[lane] = drives.cos_turn[d];
      batch.sin_turn[lane] = drives.sin_turn[d];
      batch.drive_x_mm[lane] = drives.x_mm[d];
      batch.drive_y_mm[lane] = drives.y_mm[d];
      batch.spin_mm[lane] = drives.turn_rad[d] * sub_step_part_ * kRobotRadius_mm;
    }
    bodies.heading_rad[i] = wrapped(drives.heading_rad[d] + drives.turn_rad[d]);
  }
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (hops_[i] != 0) {
      bodies.awake[i] = hops_[i] != kOutOfReach;
    } else if (seat_of_[i] == ContactPass::kStill && active_[i] != 0) {
      if (driven_[i] == 0) move_alone(bodies, i, 0, 0);
      if (lively_[i] != 0) presses_[bodies.robot[i]] = {};  // It touches nobody.
    }
  }
  if (seated_.empty() && movable_pass_.empty()) return;
  fill_contacts(bodies);
  for (const Special& s : specials_) {
    if (s.movable == kNone || !movable_pass_.has(s.movable)) continue;
    movable_pass_.add_contact(s.movable, {seat_of_[s.body], s.seat, s.normal_x, s.normal_y, s.gap_mm, s.gain,
                                          s.push_mm, s.lever_x_mm, s.lever_y_mm});
  }
  movable_pass_.set_off(movables_, pass_);
  pass_.run(limits_, limits_.sub_steps, any_overlap_,
            [&](std::uint32_t step) { movable_pass_.sub_step(step, pass_); });
  movable_pass_.finish(movables_);
  for (const Mover& m : seated_) {
    if (hops_[m.body] != 0) continue;
    const double x = bodies.x_mm[m.body], y = bodies.y_mm[m.body];
    double to_x = x + pass_.shift_x_mm(seat_of_[m.body]), to_y = y + pass_.shift_y_mm(seat_of_[m.body]);
    if (!limits_.outside(x, y)) {  // The sum is rounded, a wall is not.
      to_x = std::clamp(to_x, -limits_.x_limit_mm, limits_.x_limit_mm);
      to_y = std::clamp(to_y, -limits_.y_limit_mm, limits_.y_limit_mm);
    }
    place(bodies, m.body, to_x, to_y);
    if (keep_press(bodies, m)) bodies.awake[m.body] = 1;
  }
}

/// Whether the body goes on next tick even where it has not moved: its forces changed, or it slips, which asks for a drive
/// that may end.
bool ContactSolver::keep_press(const Bodies& bodies, const Mover& m) {
  const ContactPass::Seat seat = seat_of_[m.body];
  ContactPass::Batch& batch = pass_.batch_of(seat);
  const std::size_t lane = ContactPass::lane_of(seat);
  const ContactPass::Contact* const contacts = pass_.contacts_of(batch);
  Press press;
  press.slip_x_mm = batch.slip_x_mm[lane];
  press.slip_y_mm = batch.slip_y_mm[lane];
  const auto count = static_cast<std::uint32_t>(bodies.size());
  for (std::uint32_t p = 0; p < m.contacts && press.contacts < Press::kMost; ++p) {
    double push, rub;
    __builtin_memcpy(&push, reinterpret_cast<const char*>(&contacts[p].push_mm) + lane * sizeof push, sizeof push);
    __builtin_memcpy(&rub, reinterpret_cast<const char*>(&contacts[p].rub_mm) + lane * sizeof rub, sizeof rub);
    if (!(push > 0)) continue;
    const std::uint32_t entry = others_[m.first + p];
    press.other[press.contacts] = entry < count ? bodies.robot[entry] : specials_[entry - count].key;
    press.rub_mm[press.contacts] = entry < count ? rub : 0;
    press.push_mm[press.contacts++] = push;
  }
  Press& kept = presses_[bodies.robot[m.body]];
  const bool slips = press.slip_x_mm != 0 || press.slip_y_mm != 0;
  if (kept == press) return slips;
  kept = press;
  return true;
}

void ContactSolver::move_alone(Bodies& bodies, std::uint32_t i, double way_x_mm, double way_y_mm) const {
  if (bodies.tracked[i] != 0) return;
  const double inwards_mm = limits_.sub_steps * limits_.separation_mm;
  const auto held = [inwards_mm](double from_mm, double to_mm, double limit_mm) {
    return std::max(std::min(-limit_mm, from_mm + inwards_mm),
                    std::min(std::max(limit_mm, from_mm - inwards_mm), to_mm));
  };
  place(bodies, i, held(bodies.x_mm[i], bodies.x_mm[i] + way_x_mm, limits_.x_limit_mm),
        held(bodies.y_mm[i], bodies.y_mm[i] + way_y_mm, limits_.y_limit_mm));
}

void ContactSolver::place(Bodies& bodies, std::uint32_t i, double to_x_mm, double to_y_mm) const {
  const bool moved = to_x_mm != bodies.x_mm[i] || to_y_mm != bodies.y_mm[i];
  bodies.x_mm[i] = to_x_mm;
  bodies.y_mm[i] = to_y_mm;
  bodies.awake[i] = static_cast<std::uint8_t>(overlaps_[i] | moved | limits_.outside(to_x_mm, to_y_mm));
}

}  // namespace kilotwin::physics

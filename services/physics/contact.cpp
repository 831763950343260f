#include "services/physics/contact.hpp"

#include <algorithm>

namespace kilotwin::physics {

static_assert(kDiameter_mm == 2 * kRobotRadius_mm);

ContactSolver::ContactSolver(const RunPlan& plan, const DriveModel& drive)
    : limits_(plan, drive),
      pass_limits_(limits_.of_pass()),
      sub_step_part_(1.0 / limits_.sub_steps),
      candidates_(limits_.cutoff_mm + kSkin_mm),
      world_(plan.world),
      has_shapes_(world_.arena.kind() != ArenaShape::Kind::kRectangle || !world_.obstacles.empty() ||
                  !world_.movables.empty()),
      immobile_(plan.robots()),
      cache_(plan.robots()),
      movable_pass_(plan, limits_),
      touching_(plan.movables()),
      movable_in_motion_(plan.movables()) {
  for (std::uint32_t r = 0; r < plan.robots(); ++r) {
    immobile_[r] = plan.immobile(r);
    has_immobile_ |= plan.immobile(r);
  }
  for (const MovableBodyModel& body : world_.movables) {
    movables_.push_back({body.pose.x_mm, body.pose.y_mm, body.pose.heading_rad, 0, 0, 0});
  }
}

bool ContactSolver::find(const Bodies& bodies, const std::vector<std::uint8_t>& own,
                         const std::vector<std::uint8_t>& own_movable, const std::vector<std::uint8_t>& driven) {
  const std::size_t count = bodies.size();
  driven_ = driven;
  active_.resize(count);
  for (std::size_t i = 0; i < count && has_immobile_; ++i) {
    if (immobile_[bodies.robot[i]] != 0) driven_[i] = 0;
  }
  active_count_ = 0;
  for (std::size_t i = 0; i < count; ++i) {
    active_[i] = driven_[i] | bodies.awake[i];
    active_count_ += active_[i];
  }
  bool any_moves = false;
  for (const MovableState& body : movables_) any_moves |= body.moves();
  if (active_count_ == 0 && !any_moves) return false;

  if (own.empty() && !has_shapes_ && !any_overlap_) {
    update_slots(bodies);
    rest_idle_batches();
    return true;
  }
  release_slots();
  slot_robot_ = bodies.robot;
  in_motion_.resize(count);
  for (std::size_t i = 0; i < count; ++i) in_motion_[i] = driven_[i] | cache_.any(bodies.robot[i]);
  candidates_.update(bodies);
  find_specials(bodies);
  search_all(bodies, own, own_movable);
  assign_slots();
  assign_point_slots();
  pass_.rest();
  fill_batches(bodies, 0, false);
  if (has_others_) {
    needs_drive_.resize(count);
    for (std::size_t i = 0; i < count; ++i) needs_drive_[i] = driven_[i] & (hops_[i] != kOutOfReach);
  }
  return true;
}

/// Positions, drives, normals, gaps and velocities at the tick's start.
void ContactSolver::begin(const Bodies& bodies, const BodyColumns& columns) {
  any_overlap_ = any_overlap_ && !slots_are_kept_;
  for (std::size_t b = 1; b < pass_.batches(); ++b) {
    ContactBatch& batch = pass_.batch(b);
    if (batch.size == 0 || (slots_are_kept_ && batch.passes == 0)) continue;
    Start start = pass_.begin(pass_limits_, slots_are_kept_, columns, b);
    if (slots_are_kept_ && start.is_new) {
      order_contacts(batch);
      start = pass_.begin(pass_limits_, slots_are_kept_, columns, b);
    }
    batch.overlap = start.nearest_mm - kDiameter_mm < -kOverlapTolerance_mm;
    any_overlap_ |= batch.overlap;
    if (!(start.nearest_mm > 0)) {
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        separate_lane(bodies, lane, batch, pass_.contacts_of(batch));
    }
    if (batch.special) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const bool is_body = lane < batch.size;
        fill_specials(lane, is_body ? slot_movers_[(b - 1) * kLanes + lane] : Mover{batch.body[lane], 0, 0, 0},
                      batch);
      }
    }
    if (!slots_are_kept_) continue;
    if (batch.used == 0 && !batch.near_wall) batch.passes = 0;  // move() advances them as free bodies.
    remember_forces(batch);
  }
}

void ContactSolver::move(Bodies& bodies, Drives& drives) {
  drives.spread(bodies.size());
  const BodyColumns columns{bodies.x_mm.data(),     bodies.y_mm.data(),     drives.x_mm.data(),
                            drives.y_mm.data(),     drives.cos_turn.data(), drives.sin_turn.data(),
                            drives.turn_rad.data(), driven_.data()};
  for (Special& special : specials_)
    special.normal_impulse_mm = cache_[bodies.robot[special.body]].contact_with(special.key).normal_impulse_mm;
  begin(bodies, columns);
  pass_.kernel().move_free(pass_limits_, columns, bodies.x_mm.data(), bodies.y_mm.data(), bodies.heading_rad.data(),
                           bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies.awake[i] = driven_[i] | bodies.tracked[i];
  for (std::size_t i = 0; i < bodies.size() && !slots_are_kept_; ++i) {
    if (hops_[i] != 0) {
      bodies.awake[i] = hops_[i] != kOutOfReach;
    } else if (slot_of_[i] == ContactPass::kStill && active_[i] != 0 && in_motion_[i] != 0) {
      cache_.clear(bodies.robot[i]);  // It touches nothing.
    }
  }
  if (slot_movers_.empty() && movable_pass_.empty()) return;
  for (const Special& s : specials_) {
    if (s.movable == kNone || !movable_pass_.has(s.movable)) continue;
    movable_pass_.add_contact(s.movable, {slot_of_[s.body], s.slot, s.normal_x, s.normal_y, s.gap_mm, s.gain,
                                          s.normal_impulse_mm, s.lever_x_mm, s.lever_y_mm});
  }
  movable_pass_.start(movables_, pass_);
  pass_.run(pass_limits_, any_overlap_, [&](std::uint32_t step) { movable_pass_.sub_step(step, pass_); });
  movable_pass_.finish(movables_);
  end(bodies);
}

/// Writes the batches' positions into the own bodies, and marks those awake that must be searched in the next tick. A body
/// that did not move is awake as well if its impulses changed, or if it slips: its slip decays only under the solver.
void ContactSolver::end(Bodies& bodies) {
  for (std::size_t b = 1; b < pass_.batches(); ++b) {
    ContactBatch& batch = pass_.batch(b);
    if (batch.passes == 0) continue;
    if (batch.contacts > CachedContacts::kMost) drop_excess_contacts(batch);
    for (std::size_t lane = 0; lane < batch.size; ++lane) {
      const std::uint32_t i = batch.body[lane];
      if (hops_[i] != 0) continue;
      const double x = batch.x_mm[lane], y = batch.y_mm[lane];
      double to_x = x + batch.shift_x_mm[lane], to_y = y + batch.shift_y_mm[lane];
      if (batch.near_wall && !limits_.outside(x, y)) {  // The rounded sum may lie beyond the wall.
        to_x = std::clamp(to_x, -limits_.x_limit_mm, limits_.x_limit_mm);
        to_y = std::clamp(to_y, -limits_.y_limit_mm, limits_.y_limit_mm);
      }
      bodies.x_mm[i] = to_x;
      bodies.y_mm[i] = to_y;
      if (driven_[i] != 0 && slots_are_kept_) continue;  // It is awake already.
      const bool moved = to_x != x || to_y != y || limits_.outside(to_x, to_y);
      const bool changed =
          slots_are_kept_
              ? batch.overlap || !is_steady(batch, lane)
              : store_contacts(bodies.robot[i], slot_movers_[(b - 1) * kLanes + lane]) || overlaps_[i] != 0;
      bodies.awake[i] = static_cast<std::uint8_t>(moved | changed | (driven_[i] != 0));
    }
  }
  cache_is_current_ = !slots_are_kept_;
}

/// Sets the impulses of contacts beyond the cache's capacity to 0.
void ContactSolver::drop_excess_contacts(const ContactBatch& batch) {
  ContactLanes* const contacts = pass_.contacts_of(batch);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    std::size_t n = 0;
    for (std::uint32_t p = 0; p < batch.contacts; ++p) {
      if (contacts[p].normal_impulse_mm[lane] > 0 && ++n > CachedContacts::kMost)
        contacts[p].normal_impulse_mm[lane] = contacts[p].tangent_impulse_mm[lane] = 0;
    }
  }
}

/// Saves the impulses of a batch with undriven bodies at the tick's start; is_steady() compares with them.
void ContactSolver::remember_forces(ContactBatch& batch) {
  int all_driven = 1;
  for (const std::uint32_t body : batch.body) all_driven &= driven_[body];
  if (all_driven != 0) return;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    batch.slips[lane] = batch.slip_x_mm[lane] != 0 || batch.slip_y_mm[lane] != 0;
  const std::size_t first = 2 * kLanes * batch.first_contact, size = 2 * kLanes * batch.contacts;
  if (remembered_.size() < first + size) remembered_.resize(2 * (first + size));
  double* to = remembered_.data() + first;
  const ContactLanes* const contacts = pass_.contacts_of(batch);
  for (std::uint32_t p = 0; p < batch.contacts; ++p) {
    to = std::copy_n(contacts[p].normal_impulse_mm, kLanes, to);
    to = std::copy_n(contacts[p].tangent_impulse_mm, kLanes, to);
  }
}

/// Whether an undriven body has no slip, and the same impulses as at the tick's start.
bool ContactSolver::is_steady(const ContactBatch& batch, std::size_t lane) const {
  bool same = !batch.slips[lane] && batch.slip_x_mm[lane] == 0 && batch.slip_y_mm[lane] == 0;
  const double* from = remembered_.data() + 2 * kLanes * batch.first_contact + lane;
  const ContactLanes* const contacts = pass_.contacts_of(batch);
  for (std::uint32_t p = 0; p < batch.contacts; ++p, from += 2 * kLanes)
    same &= contacts[p].normal_impulse_mm[lane] == from[0] && contacts[p].tangent_impulse_mm[lane] == from[kLanes];
  return same;
}

}  // namespace kilotwin::physics

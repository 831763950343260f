#include "services/physics/planar_engine.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::physics {

PlanarEngine::PlanarEngine(const RunPlan& plan, PartitionId partition)
    : PlanarEngine(plan, partition, DriveModel(plan)) {}

PlanarEngine::PlanarEngine(const RunPlan& plan, PartitionId partition, const DriveModel& drive)
    : PopulationEngine(plan, partition, drive, ContactLimits(plan, drive).margin_mm),
      grid_(plan.grid),
      rectangle_(plan.grid.rectangle(partition)),
      contact_(plan, drive) {
  margin_mm_ = population_.ghost_margin_mm();
  slack_mm_ = 2 * contact_.limits().sub_steps * contact_.limits().stride_mm;
  for (const MovableBodyModel& body : plan.world.movables) reach_mm_.push_back(body.shape.reach_mm());
  own_movable_.resize(plan.movables());
  list_movables();
}

void PlanarEngine::list_movables() {
  listed_movable_.resize(reach_mm_.size());
  for (std::size_t m = 0; m < reach_mm_.size(); ++m) listed_movable_[m] = is_own(contact_.movables()[m]);
}

/// Reads ghosts' contacts and movable bodies from their owners' frames.
void PlanarEngine::read_ghosts(const Inputs& inputs) {
  Bodies& known = population_.known();
  for (const BodyFrame* frame : inputs.ghosts) {
    const MovableColumns& movable = frame->movable;
    for (std::size_t i = 0; i < movable.body.size(); ++i) {
      contact_.movables()[movable.body[i]] = {movable.x_mm[i],  movable.y_mm[i],  movable.heading_rad[i],
                                              movable.vx_mm[i], movable.vy_mm[i], movable.turn_rad[i]};
    }
    for (const std::uint32_t robot : frame->robot) contact_.cache().clear(robot);
    const ContactColumns& contact = frame->contact;
    std::size_t at = 0;
    for (std::size_t i = 0; i < contact.robot.size(); ++i) {
      CachedContacts cached;
      cached.slip_x_mm = contact.slip_x_mm[i];
      cached.slip_y_mm = contact.slip_y_mm[i];
      for (std::uint32_t p = 0; p < contact.count[i]; ++p, ++at) {
        if (p >= CachedContacts::kMost) continue;
        cached.contact[p] = {contact.normal_impulse_mm[at], contact.tangent_impulse_mm[at], contact.other[at]};
        cached.contacts = p + 1;
      }
      contact_.cache().set(contact.robot[i], cached);
      const auto found = std::lower_bound(known.robot.begin(), known.robot.end(), contact.robot[i]);
      if (found != known.robot.end() && *found == contact.robot[i])
        known.awake[static_cast<std::size_t>(found - known.robot.begin())] = 1;
    }
  }
}

void PlanarEngine::move(Tick from, const Inputs& inputs) {
  read_ghosts(inputs);
  Bodies& known = population_.known();
  for (std::size_t m = 0; m < own_movable_.size(); ++m) own_movable_[m] = is_own(contact_.movables()[m]);
  listed_movable_ = own_movable_;
  if (!contact_.find(known, population_.own(), own_movable_, population_.driven())) return;
  fill_drives(from);
  contact_.move(known, drives_);
}

void PlanarEngine::relocated(const Relocation& relocation) {
  const auto& [movable, body, pose] = relocation;
  if (movable) {
    contact_.movables()[body] = {pose.x_mm, pose.y_mm, pose.heading_rad};
    list_movables();
  } else {
    contact_.cache().clear(body);
  }
}

void PlanarEngine::fill_drives(Tick from) {
  const Bodies& known = population_.known();
  drives_.count = 0;
  population_.drive().add(drives_, contact_.needs_drive(), known.robot, from, population_.duties(),
                          known.heading_rad, contact_.drive_part());
  population_.complete(from, drives_);
}

void PlanarEngine::add_movables(BodyFrame& frame) const {
  frame.movable.clear();
  for (std::uint32_t m = 0; m < listed_movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const MovableState& body = contact_.movables()[m];
    frame.movable.body.push_back(m);
    frame.movable.x_mm.push_back(body.x_mm);
    frame.movable.y_mm.push_back(body.y_mm);
    frame.movable.heading_rad.push_back(body.heading_rad);
    frame.movable.vx_mm.push_back(body.vx_mm);
    frame.movable.vy_mm.push_back(body.vy_mm);
    frame.movable.turn_rad.push_back(body.turn_rad);
  }
}

void PlanarEngine::emit_bodies(BodyFrame& frame) const {
  population_.emit_bodies(frame);
  add_movables(frame);
}

void PlanarEngine::emit_ghosts(PartitionId neighbour, BodyFrame& frame) const {
  population_.emit_ghosts(neighbour, frame);
  const Bodies& listed = population_.listed();
  const std::vector<MovableState>& movables = contact_.movables();
  if (!movables.empty()) {
    // Send the movable bodies that the neighbour reaches, directly or through others, and all robots beside them. Poses of
    // other partitions' bodies are one tick old here; the slack covers their motion.
    const Rectangle& rectangle = grid_.rectangle(neighbour);
    std::vector<std::uint32_t> reached;
    std::vector<std::uint8_t> is_reached(movables.size(), 0);
    const auto take = [&](std::uint32_t m) {
      if (is_reached[m]++ == 0) reached.push_back(m);
    };
    for (std::uint32_t m = 0; m < movables.size(); ++m) {
      if (rectangle.distance_mm(movables[m].x_mm, movables[m].y_mm) <= reach_mm_[m] + margin_mm_ + slack_mm_)
        take(m);
    }
    for (std::size_t k = 0; k < reached.size(); ++k) {
      for (std::uint32_t m = 0; m < movables.size(); ++m) {
        const double dx = movables[m].x_mm - movables[reached[k]].x_mm,
                     dy = movables[m].y_mm - movables[reached[k]].y_mm;
        const double near_mm = reach_mm_[m] + reach_mm_[reached[k]] + margin_mm_ + slack_mm_;
        if (dx * dx + dy * dy <= near_mm * near_mm && is_reached[m] == 0) take(m);
      }
    }
    const auto wanted = [&](double x, double y) {
      if (rectangle.distance_mm(x, y) <= margin_mm_) return true;
      return std::any_of(reached.begin(), reached.end(), [&](std::uint32_t m) {
        const double dx = movables[m].x_mm - x, dy = movables[m].y_mm - y;
        const double near_mm = reach_mm_[m] + margin_mm_ + slack_mm_;
        return dx * dx + dy * dy <= near_mm * near_mm;
      });
    };
    frame.clear();
    for (std::size_t i = 0; i < listed.size(); ++i) {
      if (listed.tracked[i] == 0 && wanted(listed.x_mm[i], listed.y_mm[i])) population_.add_ghost(i, frame);
    }
  }
  add_movables(frame);
  for (const std::uint32_t robot : frame.robot) {
    if (!contact_.cache().any(robot)) continue;
    const CachedContacts& cached = contact_.cache()[robot];
    frame.contact.robot.push_back(robot);
    frame.contact.slip_x_mm.push_back(cached.slip_x_mm);
    frame.contact.slip_y_mm.push_back(cached.slip_y_mm);
    frame.contact.count.push_back(static_cast<std::uint8_t>(cached.contacts));
    for (std::uint32_t p = 0; p < cached.contacts; ++p) {
      frame.contact.other.push_back(cached.contact[p].other);
      frame.contact.normal_impulse_mm.push_back(cached.contact[p].normal_impulse_mm);
      frame.contact.tangent_impulse_mm.push_back(cached.contact[p].tangent_impulse_mm);
    }
  }
}

std::uint64_t PlanarEngine::hash_part() const {
  std::uint64_t sum = population_.hash_part() + contact_.hash_contacts(population_.listed().robot);
  for (std::uint32_t m = 0; m < listed_movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const MovableState& b = contact_.movables()[m];
    sum += entity_hash(HashDomain::kMovable, m,
                       {hash_bits(b.x_mm), hash_bits(b.y_mm), hash_bits(b.heading_rad), hash_bits(b.vx_mm),
                        hash_bits(b.vy_mm), hash_bits(b.turn_rad)});
  }
  return sum;
}

void PlanarEngine::save(proto::PhysicsState& state) const {
  population_.save(state);
  for (std::uint32_t m = 0; m < listed_movable_.size(); ++m) {
    if (listed_movable_[m] == 0) continue;
    const MovableState& b = contact_.movables()[m];
    state.add_movable(m);
    for (const double value : {b.x_mm, b.y_mm, b.heading_rad, b.vx_mm, b.vy_mm, b.turn_rad})
      state.add_movable_state(value);
  }
  for (const std::uint32_t robot : population_.listed().robot) {
    if (!contact_.cache().any(robot)) continue;
    const CachedContacts& cached = contact_.cache()[robot];
    state.add_contact_robot(robot);
    state.add_contact_count(cached.contacts);
    state.add_contact_state(cached.slip_x_mm);
    state.add_contact_state(cached.slip_y_mm);
    for (std::uint32_t p = 0; p < cached.contacts; ++p) {
      state.add_contact_other(cached.contact[p].other);
      state.add_contact_state(cached.contact[p].normal_impulse_mm);
      state.add_contact_state(cached.contact[p].tangent_impulse_mm);
    }
  }
}

void PlanarEngine::load(Tick tick, std::span<const proto::PhysicsState* const> parts) {
  population_.load(tick, parts);
  ContactCache& cache = contact_.cache();
  std::vector<MovableState>& movables = contact_.movables();
  for (std::size_t robot = 0; robot < cache.size(); ++robot) cache.clear(robot);
  std::vector<std::uint8_t> seen(movables.size(), 0);
  std::size_t found = 0;
  for (const proto::PhysicsState* part : parts) {
    if (part->movable_state_size() != 6 * part->movable_size() ||
        part->contact_count_size() != part->contact_robot_size())
      throw RunError("checkpoint: physics: columns of unequal length; the file is damaged");
    for (int i = 0; i < part->movable_size(); ++i) {
      const std::uint32_t m = part->movable(i);
      if (m >= movables.size() || seen[m]++ != 0)
        throw RunError("checkpoint: physics: movable body " + std::to_string(m) + " is unknown or occurs twice");
      const double* const s = part->movable_state().data() + 6 * i;
      movables[m] = {s[0], s[1], s[2], s[3], s[4], s[5]};
      ++found;
    }
    int value = 0, other = 0;
    for (int i = 0; i < part->contact_robot_size(); ++i) {
      const std::uint32_t robot = part->contact_robot(i), contacts = part->contact_count(i);
      const int size = static_cast<int>(std::min<std::uint32_t>(contacts, CachedContacts::kMost + 1));
      if (robot >= cache.size() || contacts > CachedContacts::kMost ||
          value + 2 + 2 * size > part->contact_state_size() || other + size > part->contact_other_size()) {
        throw RunError("checkpoint: physics: contacts of robot " + std::to_string(robot) + " are damaged");
      }
      CachedContacts cached;
      cached.slip_x_mm = part->contact_state(value++);
      cached.slip_y_mm = part->contact_state(value++);
      cached.contacts = contacts;
      for (std::uint32_t p = 0; p < contacts; ++p) {
        cached.contact[p].other = part->contact_other(other++);
        cached.contact[p].normal_impulse_mm = part->contact_state(value++);
        cached.contact[p].tangent_impulse_mm = part->contact_state(value++);
      }
      cache.set(robot, cached);
    }
  }
  if (found != movables.size()) throw RunError("checkpoint: physics: a movable body is missing");
  list_movables();
}

}  // namespace kilotwin::physics

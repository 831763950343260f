#include "services/physics/planar_engine.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"

namespace kilotwin::physics {

PlanarEngine::PlanarEngine(const RunPlan& plan, PartitionId partition)
    : grid_(plan.grid),
      partition_(partition),
      rectangle_(plan.grid.rectangle(partition)),
      robots_(plan.robots()),
      drive_(plan),
      contact_(plan, drive_),
      neighbours_(plan.grid.neighbours(partition, contact_.limits().margin_mm)) {
  for (std::uint32_t robot = 0; robot < robots_; ++robot) {
    const Pose pose = plan.initial_pose(robot);
    const double x = pose.position_mm.x(), y = pose.position_mm.y(), heading = wrapped(pose.heading_rad);
    const bool tracked = plan.tracked(robot);
    if (tracked) {
      is_tracked_.resize(robots_, 0);
      is_tracked_[robot] = 1;
      tracked_.add(robot, x, y, heading, 1, 1);
    }
    if (is_own(x, y)) listed_.add(robot, x, y, heading, tracked, 1);
  }
}

void PlanarEngine::step(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == tick_);
  take_tracked(inputs.tracked);
  for (const BodyFrame* frame : inputs.ghosts) KILOTWIN_DEMAND(frame->tick == from);
  gather(inputs.ghosts);
  mark_own();
  read_motors(from, inputs.actuation);
  if (contact_.find(known_, own_, duties_)) {
    set_off(from);
    contact_.move(known_, drives_);
  }
  list_own();
  ++tick_;
}

void PlanarEngine::take_tracked(std::span<const TrackedPoseInput> inputs) {
  for (const TrackedPoseInput& input : inputs) {
    const auto found = std::lower_bound(tracked_.robot.begin(), tracked_.robot.end(), input.robot);
    KILOTWIN_DEMAND(found != tracked_.robot.end() && *found == input.robot);
    const auto i = static_cast<std::size_t>(found - tracked_.robot.begin());
    tracked_.x_mm[i] = input.x_mm;
    tracked_.y_mm[i] = input.y_mm;
    tracked_.heading_rad[i] = wrapped(input.heading_rad);
  }
}

void PlanarEngine::gather(std::span<const BodyFrame* const> ghosts) {
  if (ghosts.empty() && tracked_.size() == 0) {
    known_.swap(listed_);
    return;
  }
  const double margin_mm = contact_.limits().margin_mm;
  unsorted_.clear();
  for (std::size_t i = 0; i < listed_.size(); ++i) {
    if (listed_.tracked[i] == 0) unsorted_.add(listed_, i);
  }
  for (std::size_t i = 0; i < tracked_.size(); ++i) {
    if (rectangle_.distance_mm(tracked_.x_mm[i], tracked_.y_mm[i]) <= margin_mm) unsorted_.add(tracked_, i);
  }
  for (const BodyFrame* frame : ghosts) {
    for (std::size_t i = 0; i < frame->robot.size(); ++i) {
      const std::uint32_t robot = frame->robot[i];
      if (!is_tracked_.empty() && is_tracked_[robot] != 0) continue;
      unsorted_.add(robot, frame->x_mm[i], frame->y_mm[i], frame->heading_rad[i], 0, 1);
    }
  }
  known_.assign_sorted(unsorted_, order_);
}

void PlanarEngine::mark_own() {
  own_.clear();
  if (grid_.size() == 1) return;
  own_.resize(known_.size());
  for (std::size_t i = 0; i < known_.size(); ++i) own_[i] = is_own(known_.x_mm[i], known_.y_mm[i]) ? 1 : 0;
}

void PlanarEngine::read_motors(Tick from, std::span<const ActuationFrame* const> frames) {
  frames_.assign(frames.begin(), frames.end());
  std::sort(frames_.begin(), frames_.end(), [](const ActuationFrame* a, const ActuationFrame* b) {
    return a->first_robot < b->first_robot;
  });
  for (const ActuationFrame* frame : frames_) KILOTWIN_DEMAND(frame->tick == from);
  duties_.assign(known_.size(), Duties{});
  std::size_t body = 0;
  for (const ActuationFrame* frame : frames_) {
    const std::uint32_t first = frame->first_robot;
    const auto size = static_cast<std::uint32_t>(frame->motor_left.size());
    while (body < known_.size() && known_.robot[body] < first) ++body;
    for (; body < known_.size() && known_.robot[body] - first < size; ++body) {
      const std::uint32_t entry = known_.robot[body] - first;
      if (known_.tracked[body] == 0) duties_[body] = {frame->motor_left[entry], frame->motor_right[entry]};
    }
  }
}

void PlanarEngine::set_off(Tick from) {
  drives_.reserve(known_.size());
  drives_.count = 0;
  for (std::uint32_t i = 0; i < known_.size(); ++i) {
    if (!duties_[i].any() || !contact_.asks_drive(i)) continue;
    drive_.add(drives_, i, known_.robot[i], from, duties_[i], known_.heading_rad[i], contact_.drive_part(i));
  }
  drive_.integrate(drives_);
}

void PlanarEngine::list_own() {
  if (grid_.size() == 1) {
    listed_.swap(known_);
    return;
  }
  listed_.clear();
  for (std::size_t i = 0; i < known_.size(); ++i) {
    if (own_[i] != 0) listed_.add(known_, i);
  }
}

void PlanarEngine::emit_bodies(BodyFrame& frame) const {
  frame.tick = tick_;
  frame.robot = listed_.robot;
  frame.x_mm = listed_.x_mm;
  frame.y_mm = listed_.y_mm;
  frame.heading_rad = listed_.heading_rad;
}

void PlanarEngine::emit_ghosts(PartitionId neighbour, BodyFrame& frame) const {
  frame.clear();
  frame.tick = tick_;
  const Rectangle& rectangle = grid_.rectangle(neighbour);
  const double margin_mm = contact_.limits().margin_mm;
  for (std::size_t i = 0; i < listed_.size(); ++i) {
    const double x = listed_.x_mm[i], y = listed_.y_mm[i];
    if (listed_.tracked[i] == 0 && rectangle.distance_mm(x, y) <= margin_mm) {
      frame.add(listed_.robot[i], x, y, listed_.heading_rad[i]);
    }
  }
}

std::uint64_t PlanarEngine::hash_part() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < listed_.size(); ++i) {
    sum += entity_hash(HashDomain::kBody, listed_.robot[i],
                       {hash_bits(listed_.x_mm[i]), hash_bits(listed_.y_mm[i]), hash_bits(listed_.heading_rad[i])});
  }
  return sum;
}

void PlanarEngine::save(proto::PhysicsState& state) const {
  state.Clear();
  const auto size = static_cast<int>(listed_.size());
  state.mutable_robot()->Add(listed_.robot.begin(), listed_.robot.end());
  state.mutable_x_mm()->Add(listed_.x_mm.begin(), listed_.x_mm.end());
  state.mutable_y_mm()->Add(listed_.y_mm.begin(), listed_.y_mm.end());
  state.mutable_heading_rad()->Add(listed_.heading_rad.begin(), listed_.heading_rad.end());
  KILOTWIN_DEMAND(state.robot_size() == size && state.heading_rad_size() == size);
}

void PlanarEngine::load(Tick tick, std::span<const proto::PhysicsState* const> parts) {
  Bodies all, sorted;
  std::vector<std::uint8_t> seen(robots_, 0);
  for (const proto::PhysicsState* part : parts) {
    const int size = part->robot_size();
    if (part->x_mm_size() != size || part->y_mm_size() != size || part->heading_rad_size() != size)
      throw RunError("checkpoint: physics: columns of unequal length; the file is damaged");
    for (int i = 0; i < size; ++i) {
      const std::uint32_t robot = part->robot(i);
      if (robot >= robots_) throw RunError("checkpoint: physics: unknown robot " + std::to_string(robot));
      if (seen[robot]++ != 0) throw RunError("checkpoint: physics: robot " + std::to_string(robot) + " occurs twice");
      const bool tracked = !is_tracked_.empty() && is_tracked_[robot] != 0;
      all.add(robot, part->x_mm(i), part->y_mm(i), part->heading_rad(i), tracked, 1);
    }
  }
  if (all.size() != robots_) {
    throw RunError("checkpoint: physics: holds " + std::to_string(all.size()) + " of " + std::to_string(robots_) + " robots");
  }
  sorted.assign_sorted(all, order_);
  listed_.clear();
  tracked_.clear();
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (sorted.tracked[i] != 0) tracked_.add(sorted, i);
    if (is_own(sorted.x_mm[i], sorted.y_mm[i])) listed_.add(sorted, i);
  }
  tick_ = tick;
}

}  // namespace kilotwin::physics

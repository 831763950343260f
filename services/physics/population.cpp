#include "services/physics/population.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/state_hash.hpp"
#include "core/plan/tracking_settings.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::physics {

double Population::margin_mm(const RunPlan& plan, const DriveModel& drive, double reach_mm) {
  const double effects_mm = std::max(drive.effects().radius_mm(), ArenaFields::margin_mm(plan));
  // Movable bodies can carry the influence of robots anywhere.
  return effects_mm > 0 && plan.movables() > 0 ? 1e300 : reach_mm + effects_mm;
}

Population::Population(const RunPlan& plan, PartitionId partition, DriveModel drive, double reach_mm)
    : drive_(std::move(drive)),
      memory_(plan),
      fields_(plan, partition, margin_mm(plan, drive_, reach_mm)),
      grid_(plan.grid),
      rectangle_(plan.grid.rectangle(partition)),
      margin_mm_(margin_mm(plan, drive_, reach_mm)),
      robots_(plan.robots()),
      // All partitions know all movable bodies.
      neighbours_(plan.grid.neighbours(partition, plan.movables() > 0 ? 1e300 : margin_mm_)),
      merge_(robots_) {
  for (Bodies* const bodies : {&listed_, &tracked_, &known_, &previous_, &absentees_, &merged_})
    bodies->remembered = memory_.size();
  for (std::uint32_t robot = 0; robot < robots_; ++robot) {
    const Pose pose = plan.initial_pose(robot);
    const double x = pose.x_mm, y = pose.y_mm, heading = wrapped(pose.heading_rad);
    // A cell of a Kilogrid has no body either: it is listed like a tracked robot that is never there.
    const bool is_cell = plan.cell_side_mm(robot) > 0, tracked = plan.tracked(robot) || is_cell;
    if (tracked) {
      is_tracked_.resize(robots_, 0);
      is_tracked_[robot] = 1;
      tracked_.add(robot, x, y, heading, 1, 1);
      absent_.push_back(is_cell || !plan.tracking_settings().present_at_start);
      on_other_.push_back(0);
      memory_.start(robot, tracked_.memory_of(tracked_.size() - 1));
    }
    if (!is_own(x, y)) continue;
    listed_.add(robot, x, y, heading, tracked, 1);
    memory_.start(robot, listed_.memory_of(listed_.size() - 1));
  }
}

void Population::begin(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == tick_);
  take_tracked(inputs);
  for (const BodyFrame* frame : inputs.ghosts) KILOTWIN_DEMAND(frame->tick == from);
  gather(inputs.ghosts);
  read_motors(from, inputs.actuation);
  driven_.resize(known_.size());
  const bool act_at_rest = drive_.effects().act_at_rest();
  for (std::size_t i = 0; i < known_.size(); ++i)
    driven_[i] = static_cast<std::uint8_t>(duties_[i].any() || (act_at_rest && known_.tracked[i] == 0));
  if (memory_.size() == 0 && !fields_.any()) return;
  x_mm_ = known_.x_mm;
  y_mm_ = known_.y_mm;
  heading_rad_ = known_.heading_rad;
}

RobotColumns Population::known_columns() const {
  return {known_.robot, x_mm_, y_mm_, heading_rad_, known_.memory, duties_, known_.tracked};
}

void Population::complete(Tick from, Drives& drives) {
  if (!drive_.effects().empty()) {
    const RobotColumns known{known_.robot,  known_.x_mm, known_.y_mm,   known_.heading_rad,
                             known_.memory, duties_,     known_.tracked};
    drive_.change(drives, from, known, &fields_);
  }
  drive_.integrate(drives);
}

void Population::remember() {
  const RobotColumns before = known_columns();
  fields_.count(tick_, before, known_.memory);
  memory_.advance(tick_, before, known_.x_mm, known_.y_mm, known_.heading_rad, known_.memory);
}

void Population::take_tracked(const Inputs& inputs) {
  const auto entry_of = [this](std::uint32_t robot) {
    const auto found = std::lower_bound(tracked_.robot.begin(), tracked_.robot.end(), robot);
    KILOTWIN_DEMAND(found != tracked_.robot.end() && *found == robot);
    return static_cast<std::size_t>(found - tracked_.robot.begin());
  };
  for (const MembershipChange& change : inputs.memberships) {
    std::uint8_t& absent = absent_[entry_of(change.robot)];
    absent = static_cast<std::uint8_t>(change.membership != Membership::kJoined);
    absentees_are_listed_ = false;
  }
  if (inputs.tracking == nullptr) return;
  const TrackingFrame& frame = *inputs.tracking;
  KILOTWIN_DEMAND(frame.tick == tick_);
  for (std::size_t n = 0; n < frame.robot.size(); ++n) {
    const std::size_t i = entry_of(frame.robot[n]);
    if (absent_[i] != 0) continue;
    tracked_.x_mm[i] = frame.x_mm[n];
    tracked_.y_mm[i] = frame.y_mm[n];
    tracked_.heading_rad[i] = wrapped(frame.heading_rad[n]);
  }
}

/// Counts own tracked robots that have come to stand on another body in this step. Known bodies are few.
void Population::count_without_space() {
  constexpr double kTolerance_mm = 1, kLeast_mm = 2 * kRobotRadius_mm - kTolerance_mm;
  for (std::size_t i = 0; i < known_.size(); ++i) {
    if (known_.tracked[i] == 0) continue;
    bool overlaps = false;
    for (std::size_t j = 0; j < known_.size() && !overlaps; ++j) {
      const double dx = known_.x_mm[j] - known_.x_mm[i], dy = known_.y_mm[j] - known_.y_mm[i];
      overlaps = j != i && dx * dx + dy * dy < kLeast_mm * kLeast_mm;
    }
    const auto entry = static_cast<std::size_t>(
        std::lower_bound(tracked_.robot.begin(), tracked_.robot.end(), known_.robot[i]) - tracked_.robot.begin());
    const bool own = own_.empty() || own_[i] != 0;
    without_space_ += static_cast<std::uint32_t>(own && overlaps && on_other_[entry] == 0);
    on_other_[entry] = static_cast<std::uint8_t>(overlaps);
  }
}

void Population::relocate(std::span<const Relocation> relocations) {
  for (const auto& [movable, robot, pose] : relocations) {
    if (movable) continue;
    const auto first = std::lower_bound(listed_.robot.begin(), listed_.robot.end(), robot);
    auto at = static_cast<std::size_t>(first - listed_.robot.begin());
    const bool was_here = first != listed_.robot.end() && *first == robot;
    if (is_own(pose.x_mm, pose.y_mm)) {
      if (!was_here) listed_.insert(at);
      listed_.robot[at] = robot;
      listed_.x_mm[at] = pose.x_mm;
      listed_.y_mm[at] = pose.y_mm;
      listed_.heading_rad[at] = pose.heading_rad;
      listed_.tracked[at] = 0;
      listed_.awake[at] = 1;
      memory_.start(robot, listed_.memory_of(at));
    } else if (was_here) {
      listed_.erase(at);
    }
  }
}

/// Absent robots have their place in the list, among the others. Nothing moves them.
void Population::list_absent() {
  if (!absentees_are_listed_) {
    absentees_.clear();
    for (std::size_t i = 0; i < tracked_.size(); ++i) {
      if (absent_[i] != 0 && is_own(tracked_.x_mm[i], tracked_.y_mm[i])) absentees_.add(tracked_, i);
    }
    absentees_are_listed_ = true;
  }
  if (absentees_.size() == 0) return;
  merged_.clear();
  std::size_t next = 0;
  for (std::size_t i = 0; i < absentees_.size(); ++i) {
    while (next < listed_.size() && listed_.robot[next] < absentees_.robot[i]) merged_.add(listed_, next++);
    merged_.add(absentees_, i);
  }
  while (next < listed_.size()) merged_.add(listed_, next++);
  listed_.swap(merged_);
}

void Population::gather(std::span<const BodyFrame* const> ghosts) {
  if (grid_.size() == 1 && tracked_.size() == 0) {
    known_.swap(listed_);
    return;
  }
  // List 0 has the listed robots, list 1 the tracked ones; the others are ghosts.
  const auto add = [this](std::uint32_t robot, Merge::Entry entry) {
    if (!merge_.add(robot, entry))
      throw RunError("two partitions claim robot " + std::to_string(robot) + " at tick " +
                     std::to_string(tick_.count()));
  };
  for (std::uint32_t i = 0; i < listed_.size(); ++i) {
    if (listed_.tracked[i] == 0) add(listed_.robot[i], {0, i});
  }
  for (std::uint32_t i = 0; i < tracked_.size(); ++i) {
    if (absent_[i] == 0 && rectangle_.distance_mm(tracked_.x_mm[i], tracked_.y_mm[i]) <= margin_mm_) {
      add(tracked_.robot[i], {1, i});
    }
  }
  for (std::uint32_t g = 0; g < ghosts.size(); ++g) {
    for (std::uint32_t i = 0; i < ghosts[g]->robot.size(); ++i) {
      const std::uint32_t robot = ghosts[g]->robot[i];
      if (is_tracked_.empty() || is_tracked_[robot] == 0) add(robot, {2 + g, i});
    }
  }
  known_.swap(previous_);
  known_.resize(merge_.size());
  std::size_t n = 0, before = 0;
  merge_.drain([&](std::uint32_t robot, Merge::Entry from) {
    known_.robot[n] = robot;
    if (from.list < 2) {
      known_.set(n, from.list == 0 ? listed_ : tracked_, from.index);
    } else {
      const BodyFrame& frame = *ghosts[from.list - 2];
      const double x = frame.x_mm[from.index], y = frame.y_mm[from.index];
      while (before < previous_.size() && previous_.robot[before] < robot) ++before;
      // A body that the last step left at rest, and whose pose no input changed, is still asleep.
      const bool asleep = before < previous_.size() && previous_.robot[before] == robot &&
                          previous_.awake[before] == 0 && previous_.x_mm[before] == x &&
                          previous_.y_mm[before] == y;
      known_.x_mm[n] = x;
      known_.y_mm[n] = y;
      known_.heading_rad[n] = frame.heading_rad[from.index];
      known_.tracked[n] = 0;
      known_.awake[n] = !asleep;
      const std::span<double> memory = known_.memory_of(n);
      for (std::size_t m = 0; m < memory.size(); ++m) memory[m] = frame.memory[from.index * memory.size() + m];
    }
    ++n;
  });
  if (grid_.size() == 1) return;
  own_.resize(n);
  for (std::size_t i = 0; i < n; ++i) own_[i] = is_own(known_.x_mm[i], known_.y_mm[i]);
}

void Population::read_motors(Tick from, std::span<const ActuationFrame* const> frames) {
  frames_.assign(frames.begin(), frames.end());
  std::sort(frames_.begin(), frames_.end(),
            [](const ActuationFrame* a, const ActuationFrame* b) { return a->first_robot < b->first_robot; });
  for (const ActuationFrame* frame : frames_) KILOTWIN_DEMAND(frame->tick == from);
  duties_.assign(known_.size(), Duties{});
  std::size_t body = 0;
  for (const ActuationFrame* frame : frames_) {
    const std::uint32_t first = frame->first_robot;
    const auto size = static_cast<std::uint32_t>(frame->motor_left.size());
    while (body < known_.size() && known_.robot[body] < first) ++body;
    for (; body < known_.size() && known_.robot[body] - first < size; ++body) {
      const std::uint32_t entry = known_.robot[body] - first;
      if (known_.tracked[body] != 0) continue;
      duties_[body] =
          drive_.motors().acting(frame->motor_left[entry], frame->motor_right[entry], frame->spin_up[entry]);
    }
  }
}

void Population::end() {
  if (memory_.size() > 0 || fields_.any()) remember();
  ++tick_;
  if (tracked_.size() > 0) count_without_space();
  if (grid_.size() == 1) {
    listed_.swap(known_);
  } else {
    listed_.clear();
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if (own_[i] != 0) listed_.add(known_, i);
    }
  }
  list_absent();
}

void Population::emit_bodies(BodyFrame& frame) const {
  frame.tick = tick_;
  frame.robot = listed_.robot;
  frame.x_mm = listed_.x_mm;
  frame.y_mm = listed_.y_mm;
  frame.heading_rad = listed_.heading_rad;
  frame.memory = listed_.memory;
}

void Population::emit_ghosts(PartitionId neighbour, BodyFrame& frame) const {
  frame.clear();
  frame.tick = tick_;
  const Rectangle& rectangle = grid_.rectangle(neighbour);
  for (std::size_t i = 0; i < listed_.size(); ++i) {
    const double x = listed_.x_mm[i], y = listed_.y_mm[i];
    // Most robots are far away. This test avoids the square root of the distance.
    if (x < rectangle.x_min_mm - margin_mm_ || x > rectangle.x_max_mm + margin_mm_ ||
        y < rectangle.y_min_mm - margin_mm_ || y > rectangle.y_max_mm + margin_mm_) {
      continue;
    }
    if (listed_.tracked[i] == 0 && rectangle.distance_mm(x, y) <= margin_mm_) add_ghost(i, frame);
  }
}

void Population::add_ghost(std::size_t listed, BodyFrame& frame) const {
  frame.add(listed_.robot[listed], listed_.x_mm[listed], listed_.y_mm[listed], listed_.heading_rad[listed]);
  const auto memory = listed_.memory.begin() + static_cast<std::ptrdiff_t>(listed * listed_.remembered);
  frame.memory.insert(frame.memory.end(), memory, memory + static_cast<std::ptrdiff_t>(listed_.remembered));
}

std::uint64_t Population::hash_part() const {
  std::uint64_t sum = fields_.hash_part();
  for (std::size_t i = 0; i < listed_.size(); ++i) {
    sum += entity_hash(HashDomain::kBody, listed_.robot[i],
                       {hash_bits(listed_.x_mm[i]), hash_bits(listed_.y_mm[i]), hash_bits(listed_.heading_rad[i])});
  }
  for (std::size_t i = 0, size = listed_.remembered; size > 0 && i < listed_.size(); ++i) {
    HashState state(static_cast<std::uint64_t>(HashDomain::kMemory) << 32 | listed_.robot[i]);
    for (std::size_t m = 0; m < size; ++m) state.add(hash_bits(listed_.memory[i * size + m]));
    sum += state.finish();
  }
  return sum;
}

void Population::save(proto::PhysicsState& state) const {
  state.Clear();
  const auto size = static_cast<int>(listed_.size());
  state.mutable_robot()->Add(listed_.robot.begin(), listed_.robot.end());
  state.mutable_x_mm()->Add(listed_.x_mm.begin(), listed_.x_mm.end());
  state.mutable_y_mm()->Add(listed_.y_mm.begin(), listed_.y_mm.end());
  state.mutable_heading_rad()->Add(listed_.heading_rad.begin(), listed_.heading_rad.end());
  state.mutable_memory()->Add(listed_.memory.begin(), listed_.memory.end());
  KILOTWIN_DEMAND(state.robot_size() == size && state.heading_rad_size() == size);
  for (std::size_t i = 0; i < tracked_.size(); ++i) {
    if (absent_[i] != 0 && is_own(tracked_.x_mm[i], tracked_.y_mm[i])) state.add_absent(tracked_.robot[i]);
  }
  fields_.save(state);
}

void Population::load(Tick tick, std::span<const proto::PhysicsState* const> parts) {
  Bodies all;
  all.remembered = memory_.size();
  std::vector<std::uint8_t> seen(robots_, 0);
  for (const proto::PhysicsState* part : parts) {
    const int size = part->robot_size();
    if (part->x_mm_size() != size || part->y_mm_size() != size || part->heading_rad_size() != size ||
        static_cast<std::size_t>(part->memory_size()) != static_cast<std::size_t>(size) * all.remembered)
      throw RunError("checkpoint: physics: columns of unequal length; the file is damaged");
    for (int i = 0; i < size; ++i) {
      const std::uint32_t robot = part->robot(i);
      if (robot >= robots_) throw RunError("checkpoint: physics: unknown robot " + std::to_string(robot));
      if (seen[robot]++ != 0)
        throw RunError("checkpoint: physics: robot " + std::to_string(robot) + " occurs twice");
      const bool tracked = !is_tracked_.empty() && is_tracked_[robot] != 0;
      all.add(robot, part->x_mm(i), part->y_mm(i), part->heading_rad(i), tracked, 1);
      const std::span<double> memory = all.memory_of(all.size() - 1);
      for (std::size_t m = 0; m < memory.size(); ++m)
        memory[m] = part->memory(i * static_cast<int>(memory.size()) + static_cast<int>(m));
    }
  }
  if (all.size() != robots_) {
    throw RunError("checkpoint: physics: holds " + std::to_string(all.size()) + " of " + std::to_string(robots_) +
                   " robots");
  }
  for (std::uint32_t i = 0; i < all.size(); ++i) KILOTWIN_DEMAND(merge_.add(all.robot[i], {0, i}));
  listed_.clear();
  tracked_.clear();
  known_.clear();
  merge_.drain([&](std::uint32_t, Merge::Entry from) {
    if (all.tracked[from.index] != 0) tracked_.add(all, from.index);
    if (is_own(all.x_mm[from.index], all.y_mm[from.index])) listed_.add(all, from.index);
  });
  absent_.assign(tracked_.size(), 0);
  on_other_.assign(tracked_.size(), 0);
  without_space_ = 0;
  for (const proto::PhysicsState* part : parts) {
    for (const std::uint32_t robot : part->absent()) {
      const auto found = std::lower_bound(tracked_.robot.begin(), tracked_.robot.end(), robot);
      if (found == tracked_.robot.end() || *found != robot)
        throw RunError("checkpoint: physics: robot " + std::to_string(robot) + " is absent and not tracked");
      absent_[static_cast<std::size_t>(found - tracked_.robot.begin())] = 1;
    }
  }
  absentees_are_listed_ = false;
  fields_.load(parts);
  tick_ = tick;
}

}  // namespace kilotwin::physics

#include "services/physics/contact.hpp"

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::physics {
namespace {

constexpr double kDiameter_mm = 2 * kRobotRadius_mm;
/// By how much a limit may be missed because of rounding, mm. Sliding at a gap of 0 would stop without it.
constexpr double kLimitTolerance_mm = 1e-14;
/// Passes over the limits of a body. Two serve any two contacts that do not oppose each other.
constexpr int kLimitPasses = 2;

}  // namespace

ContactLimits::ContactLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.experiment().physics().sub_steps(), 1u, 4u)) {
  const double steps = sub_steps;
  const double sub_step_s = plan.tick_length.seconds() / steps;
  separation_mm = kSeparation_mm_s * sub_step_s;
  stride_mm = std::max(separation_mm, drive.top_speed_mm_s() * sub_step_s);
  // Before its last sub-step a pair has closed by at most 2 strides in each, and there half of the gap must be less than a
  // stride to matter.
  cutoff_mm = kDiameter_mm + 2 * steps * stride_mm;
  // A hop per sub-step, and the way of a body that leaves the rectangle in this tick.
  margin_mm = steps * cutoff_mm + steps * stride_mm;
  x_limit_mm = plan.experiment().arena().width_mm() / 2 - kRobotRadius_mm;
  y_limit_mm = plan.experiment().arena().height_mm() / 2 - kRobotRadius_mm;
}

ContactSolver::ContactSolver(const RunPlan& plan, const DriveModel& drive)
    : limits_(plan, drive), axle_offset_mm_(drive.axle_offset_mm()), cells_(limits_.cutoff_mm) {}

bool ContactLimits::outside(double x_mm, double y_mm) const {
  return x_mm > x_limit_mm || x_mm < -x_limit_mm || y_mm > y_limit_mm || y_mm < -y_limit_mm;
}

void ContactSolver::move(Bodies& bodies, const Drives& drives) {
  if (!find_contacts(bodies, drives)) return;
  move_free(bodies, drives);
  const std::size_t slots = slots_.size();
  if (slots > 1) {
    link(drives);
    for (std::uint32_t s = 0; s < limits_.sub_steps; ++s) {
      for (std::size_t slot = 1; slot < slots; ++slot) after_[slot] = next(bodies, slot);
      now_.swap(after_);
    }
    for (std::size_t slot = 1; slot < slots; ++slot) {
      const std::uint32_t i = slots_[slot].body;
      const double x = bodies.x_mm[i], y = bodies.y_mm[i];
      double to_x = x + now_[slot].x_mm, to_y = y + now_[slot].y_mm;
      if (!limits_.outside(x, y)) {  // The sum is rounded, a wall is not.
        to_x = std::clamp(to_x, -limits_.x_limit_mm, limits_.x_limit_mm);
        to_y = std::clamp(to_y, -limits_.y_limit_mm, limits_.y_limit_mm);
      }
      place(bodies, i, to_x, to_y);
    }
  }
  for (std::size_t d = 0; d < drives.count; ++d) {
    bodies.heading_rad[drives.body[d]] = wrapped(drives.heading_rad[d] + drives.turn_rad[d]);
  }
}

bool ContactSolver::find_contacts(Bodies& bodies, const Drives& drives) {
  const std::size_t count = bodies.size();
  if (drives.count == 0 && std::find(bodies.awake.begin(), bodies.awake.end(), 1) == bodies.awake.end()) return false;
  slots_.assign(1, Slot{});
  contacts_.clear();
  drive_of_.assign(count, 0);
  for (std::size_t d = 0; d < drives.count; ++d) drive_of_[drives.body[d]] = static_cast<std::uint32_t>(d + 1);
  slot_of_.assign(count, 0);
  cells_.build(bodies.x_mm, bodies.y_mm);
  overlaps_.assign(count, 0);
  is_pulled_.assign(count, 0);
  pulled_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (bodies.awake[i] != 0 || drive_of_[i] != 0) search(bodies, i);
  }
  // A sleeping body beside one that is driven or overlaps may be pushed.
  for (const std::uint32_t i : pulled_) search(bodies, i);
  return true;
}

void ContactSolver::search(const Bodies& bodies, std::uint32_t i) {
  const double x = bodies.x_mm[i], y = bodies.y_mm[i];
  const std::size_t count = cells_.find(x, y, i, found_);
  if (count == 0) return;
  const std::size_t first = contacts_.size();
  contacts_.resize(first + count);
  if (half_gap_mm_.size() < count) half_gap_mm_.resize(count);
  const bool driven = drive_of_[i] != 0, rouses = driven || bodies.awake[i] != 0;
  bool may_move = driven || limits_.outside(x, y);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t j = found_[k];
    const double dx = bodies.x_mm[j] - x, dy = bodies.y_mm[j] - y;
    const double distance = __builtin_sqrt(dx * dx + dy * dy);
    Contact& contact = contacts_[first + k];
    contact.other = j;
    if (distance > 0) {
      const double inverse = 1 / distance;
      contact.normal_x = dx * inverse;
      contact.normal_y = dy * inverse;
    } else {  // The same place: they part along x, the lower id to the left.
      contact.normal_x = j > i ? 1 : -1;
      contact.normal_y = 0;
    }
    contact.gap_mm = distance - kDiameter_mm;
    const bool overlap = contact.gap_mm < -kOverlapTolerance_mm;
    if (overlap) overlaps_[i] = overlaps_[j] = 1;
    may_move |= overlap | (drive_of_[j] != 0);
    if (rouses && (overlap || driven) && bodies.awake[j] == 0 && drive_of_[j] == 0 && is_pulled_[j] == 0) {
      is_pulled_[j] = 1;
      pulled_.push_back(j);
    }
  }
  if (!may_move || bodies.tracked[i] != 0) {
    contacts_.resize(first);
    return;
  }
  slot_of_[i] = static_cast<std::uint32_t>(slots_.size());
  Slot slot;
  slot.body = i;
  slot.first_contact = static_cast<std::uint32_t>(first);
  const double way_mm = limits_.sub_steps * limits_.stride_mm;
  slot.near_wall = x > limits_.x_limit_mm - way_mm || x < -limits_.x_limit_mm + way_mm || y > limits_.y_limit_mm - way_mm ||
                   y < -limits_.y_limit_mm + way_mm;
  slots_.push_back(slot);
}

void ContactSolver::link(const Drives& drives) {
  for (Contact& contact : contacts_) contact.other = slot_of_[contact.other];
  const std::size_t count = slots_.size();
  now_.assign(count, Motion{});
  after_.assign(count, Motion{});
  const double per_step = 1.0 / limits_.sub_steps;
  for (std::size_t s = 1; s < count; ++s) {
    Slot& slot = slots_[s];
    if (drive_of_[slot.body] == 0) continue;
    const std::size_t d = drive_of_[slot.body] - 1;
    const Arc arc = arc_of(drives.run_mm[d] * per_step, drives.turn_rad[d] * per_step, axle_offset_mm_);
    slot.cos_turn = arc.cos_turn;
    slot.sin_turn = arc.sin_turn;
    now_[s].drive_x_mm = drives.cos_heading[d] * arc.forward_mm - drives.sin_heading[d] * arc.sideways_mm;
    now_[s].drive_y_mm = drives.sin_heading[d] * arc.forward_mm + drives.cos_heading[d] * arc.sideways_mm;
  }
  slots_.push_back(Slot{});  // Ends the contacts of the last slot.
  slots_.back().first_contact = static_cast<std::uint32_t>(contacts_.size());
}

void ContactSolver::place(Bodies& bodies, std::uint32_t i, double to_x_mm, double to_y_mm) const {
  const bool moved = to_x_mm != bodies.x_mm[i] || to_y_mm != bodies.y_mm[i];
  bodies.x_mm[i] = to_x_mm;
  bodies.y_mm[i] = to_y_mm;
  bodies.awake[i] = static_cast<std::uint8_t>(overlaps_[i] | moved | limits_.outside(to_x_mm, to_y_mm));
}

void ContactSolver::move_free(Bodies& bodies, const Drives& drives) const {
  const double way_mm = limits_.sub_steps * limits_.separation_mm;
  const auto held = [way_mm](double from_mm, double to_mm, double limit_mm) {
    const double highest_mm = std::max(limit_mm, from_mm - way_mm), lowest_mm = std::min(-limit_mm, from_mm + way_mm);
    return std::max(lowest_mm, std::min(highest_mm, to_mm));
  };
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const std::uint32_t drive = drive_of_[i];
    if (slot_of_[i] != 0 || (drive == 0 && bodies.awake[i] == 0)) continue;
    double x = bodies.x_mm[i], y = bodies.y_mm[i];
    if (bodies.tracked[i] == 0) {
      x = held(x, drive != 0 ? x + drives.x_mm[drive - 1] : x, limits_.x_limit_mm);
      y = held(y, drive != 0 ? y + drives.y_mm[drive - 1] : y, limits_.y_limit_mm);
    }
    place(bodies, i, x, y);
  }
}

ContactSolver::Motion ContactSolver::next(const Bodies& bodies, std::size_t slot_index) {
  const Slot& slot = slots_[slot_index];
  const Motion me = now_[slot_index];
  const Contact* const contacts = contacts_.data() + slot.first_contact;
  const std::size_t count = slots_[slot_index + 1].first_contact - slot.first_contact;
  double* const limit_mm = half_gap_mm_.data();

  double x = me.drive_x_mm, y = me.drive_y_mm;  // wanted, then limited
  for (std::size_t k = 0; k < count; ++k) {
    const Contact& c = contacts[k];
    const Motion& other = now_[c.other];
    const double gap = c.gap_mm + (c.normal_x * (other.x_mm - me.x_mm) + c.normal_y * (other.y_mm - me.y_mm));
    const double half = std::max(0.0, 0.5 * gap);
    const double advance = -(c.normal_x * other.drive_x_mm + c.normal_y * other.drive_y_mm);
    const double retreat = -(c.normal_x * me.drive_x_mm + c.normal_y * me.drive_y_mm);
    double push = std::max(0.0, advance - std::max(half, retreat));
    if (gap < -kOverlapTolerance_mm) push += std::min(-0.5 * gap, limits_.separation_mm);
    x -= push * c.normal_x;
    y -= push * c.normal_y;
    limit_mm[k] = half;
  }

  constexpr double kFar_mm = 1e300;
  double left_mm = -kFar_mm, right_mm = kFar_mm, down_mm = -kFar_mm, up_mm = kFar_mm;
  if (slot.near_wall) {
    const double x_at = bodies.x_mm[slot.body] + me.x_mm, y_at = bodies.y_mm[slot.body] + me.y_mm;
    right_mm = limits_.x_limit_mm - x_at;
    left_mm = -limits_.x_limit_mm - x_at;
    up_mm = limits_.y_limit_mm - y_at;
    down_mm = -limits_.y_limit_mm - y_at;
    // Outside of a wall it moves inwards, as far as its neighbours let it.
    x += std::max(std::min(right_mm, 0.0), -limits_.separation_mm) + std::min(std::max(left_mm, 0.0), limits_.separation_mm);
    y += std::max(std::min(up_mm, 0.0), -limits_.separation_mm) + std::min(std::max(down_mm, 0.0), limits_.separation_mm);
    right_mm = std::max(right_mm, 0.0);
    left_mm = std::min(left_mm, 0.0);
    up_mm = std::max(up_mm, 0.0);
    down_mm = std::min(down_mm, 0.0);
  }

  const double square = x * x + y * y;
  if (square > limits_.stride_mm * limits_.stride_mm) {
    const double scale = limits_.stride_mm / __builtin_sqrt(square);
    x *= scale;
    y *= scale;
  }

  for (int pass = 0; pass < kLimitPasses; ++pass) {
    for (std::size_t k = 0; k < count; ++k) {
      const Contact& c = contacts[k];
      const double excess = std::max(0.0, c.normal_x * x + c.normal_y * y - limit_mm[k]);
      x -= excess * c.normal_x;
      y -= excess * c.normal_y;
    }
    x = std::max(left_mm, std::min(right_mm, x));
    y = std::max(down_mm, std::min(up_mm, y));
  }
  double scale = 1;
  for (std::size_t k = 0; k < count; ++k) {
    const double closing = contacts[k].normal_x * x + contacts[k].normal_y * y;
    if (closing > limit_mm[k] + kLimitTolerance_mm && scale * closing > limit_mm[k]) scale = limit_mm[k] / closing;
  }

  Motion to;
  to.x_mm = me.x_mm + scale * x;
  to.y_mm = me.y_mm + scale * y;
  to.drive_x_mm = slot.cos_turn * me.drive_x_mm - slot.sin_turn * me.drive_y_mm;
  to.drive_y_mm = slot.sin_turn * me.drive_x_mm + slot.cos_turn * me.drive_y_mm;
  return to;
}

}  // namespace kilotwin::physics

#include "services/physics/contact.hpp"

#include <algorithm>

namespace kilotwin::physics {
namespace {

constexpr double kDiameter_mm = 2 * kRobotRadius_mm;
/// By how much a limit may be missed because of rounding, mm. Sliding at a gap of 0 would stop without it.
constexpr double kLimitTolerance_mm = 1e-14;
/// How many limits of a body are met exactly, the one that is missed most first; what is missed then scales all down.
constexpr int kLimitRounds = 2;

// By value, so that compilers take one instruction instead of a branch that they cannot predict.
inline double larger(double a, double b) { return a > b ? a : b; }
inline double smaller(double a, double b) { return a < b ? a : b; }

using Two = double __attribute__((vector_size(16)));
inline Two larger(Two a, Two b) { return a > b ? a : b; }
inline Two smaller(Two a, Two b) { return a < b ? a : b; }
inline Two firsts(Two a, Two b) { return __builtin_shufflevector(a, b, 0, 2); }
inline Two seconds(Two a, Two b) { return __builtin_shufflevector(a, b, 1, 3); }

constexpr std::uint32_t kNobody = 0xffffffffu;
constexpr double kUnlimited_mm = 1e300;

inline Two both(double a) { return Two{a, a}; }
inline Two swapped(Two a) { return __builtin_shufflevector(a, a, 1, 0); }

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
      any_overlap_ ? sub_step<true>(bodies) : sub_step<false>(bodies);
      now_.swap(after_);
    }
    for (std::size_t slot = 1; slot < slots; ++slot) {
      const std::uint32_t i = slots_[slot].body;
      const double x = bodies.x_mm[i], y = bodies.y_mm[i];
      double to_x = x + now_[slot].shift_mm[0], to_y = y + now_[slot].shift_mm[1];
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
  pair_count_ = 0;
  any_overlap_ = false;
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
  // A sleeping body that touches one that is driven, or overlaps, may be moved.
  for (std::size_t k = 0; k < pulled_.size(); ++k) search(bodies, pulled_[k]);
  return true;
}

void ContactSolver::search(const Bodies& bodies, std::uint32_t i) {
  const double x = bodies.x_mm[i], y = bodies.y_mm[i];
  const std::size_t count = cells_.find(x, y, i, found_);
  if (count == 0) return;
  const std::size_t pairs = (count + 1) / 2, first = pair_count_;
  if (pairs_.size() < first + pairs) pairs_.resize(2 * (first + pairs));
  if (half_gap_mm_.size() < pairs) half_gap_mm_.resize(pairs);
  const bool driven = drive_of_[i] != 0;
  bool may_move = driven || limits_.outside(x, y);
  for (std::size_t p = 0; p < pairs; ++p) {
    const bool filled_up = 2 * p + 1 == count;
    const std::uint32_t j[2] = {found_[2 * p], found_[filled_up ? 2 * p : 2 * p + 1]};
    const Two dx = Two{bodies.x_mm[j[0]], bodies.x_mm[j[1]]} - x, dy = Two{bodies.y_mm[j[0]], bodies.y_mm[j[1]]} - y;
    const Two square = dx * dx + dy * dy;
    const Two distance = {__builtin_sqrt(square[0]), __builtin_sqrt(square[1])};
    const Two inverse = 1 / distance;
    ContactPair& pair = pairs_[first + p];
    pair.normal_x = dx * inverse;
    pair.normal_y = dy * inverse;
    pair.gap_mm = distance - kDiameter_mm;
    for (int k = 0; k < 2; ++k) {
      pair.other[k] = j[k];
      if (!(distance[k] > 0)) {  // The same place: they part along x, the lower id to the left.
        pair.normal_x[k] = j[k] > i ? 1 : -1;
        pair.normal_y[k] = 0;
      }
      const bool overlap = pair.gap_mm[k] < -kOverlapTolerance_mm, other_driven = drive_of_[j[k]] != 0;
      if (overlap) {
        overlaps_[i] = overlaps_[j[k]] = 1;
        any_overlap_ = true;
      }
      may_move |= overlap || other_driven;
      if ((driven || overlap) && !other_driven && bodies.awake[j[k]] == 0 && is_pulled_[j[k]] == 0) {
        is_pulled_[j[k]] = 1;
        pulled_.push_back(j[k]);
      }
    }
    if (filled_up) {
      pair.normal_x[1] = pair.normal_y[1] = 0;
      pair.gap_mm[1] = kUnlimited_mm;
      pair.other[1] = kNobody;
    }
  }
  if (!may_move || bodies.tracked[i] != 0) return;
  pair_count_ = first + pairs;
  slot_of_[i] = static_cast<std::uint32_t>(slots_.size());
  Slot slot;
  slot.body = i;
  slot.first_pair = static_cast<std::uint32_t>(first);
  const double way_mm = limits_.sub_steps * limits_.stride_mm;
  slot.near_wall = x > limits_.x_limit_mm - way_mm || x < -limits_.x_limit_mm + way_mm || y > limits_.y_limit_mm - way_mm ||
                   y < -limits_.y_limit_mm + way_mm;
  slots_.push_back(slot);
}

void ContactSolver::link(const Drives& drives) {
  for (std::size_t p = 0; p < pair_count_; ++p) {
    for (std::uint32_t& other : pairs_[p].other) other = other == kNobody ? 0 : slot_of_[other];
  }
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
    now_[s].drive_mm = Two{drives.cos_heading[d] * arc.forward_mm - drives.sin_heading[d] * arc.sideways_mm,
                           drives.sin_heading[d] * arc.forward_mm + drives.cos_heading[d] * arc.sideways_mm};
  }
  slots_.push_back(Slot{});  // Ends the contacts of the last slot.
  slots_.back().first_pair = static_cast<std::uint32_t>(pair_count_);

  // Bodies with equally many contacts one after the other, so that the loops over contacts are predictable.
  const auto group = [&](std::size_t s) { return std::min<std::size_t>(slots_[s + 1].first_pair - slots_[s].first_pair, kMorePairs); };
  pairs_end_.fill(0);
  for (std::size_t s = 1; s < count; ++s) ++pairs_end_[group(s)];
  for (std::size_t g = 1; g <= kMorePairs; ++g) pairs_end_[g] += pairs_end_[g - 1];
  by_pairs_.resize(count - 1);
  for (std::size_t s = count; --s > 0;) by_pairs_[--pairs_end_[group(s)]] = static_cast<std::uint32_t>(s);
  for (std::size_t g = 0; g < kMorePairs; ++g) pairs_end_[g] = pairs_end_[g + 1];
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
    const double highest_mm = larger(limit_mm, from_mm - way_mm), lowest_mm = smaller(-limit_mm, from_mm + way_mm);
    return larger(lowest_mm, smaller(highest_mm, to_mm));
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

template <bool kWithOverlaps>
void ContactSolver::sub_step(const Bodies& bodies) {
  const std::size_t end = by_pairs_.size();
  std::size_t i = 0;
  for (; i < pairs_end_[0]; ++i) move_slot<kWithOverlaps, 0>(bodies, by_pairs_[i]);
  for (; i < pairs_end_[1]; ++i) move_slot<kWithOverlaps, 1>(bodies, by_pairs_[i]);
  for (; i < pairs_end_[2]; ++i) move_slot<kWithOverlaps, 2>(bodies, by_pairs_[i]);
  for (; i < pairs_end_[3]; ++i) move_slot<kWithOverlaps, 3>(bodies, by_pairs_[i]);
  for (; i < end; ++i) move_slot<kWithOverlaps, kMorePairs>(bodies, by_pairs_[i]);
}

template <bool kWithOverlaps, std::size_t kPairs>
inline void ContactSolver::move_slot(const Bodies& bodies, std::uint32_t s) {
  const Motion* const now = now_.data();
  Two few_limits_mm[kPairs == kMorePairs ? 1 : kPairs + 1];
  Two* const limit_mm = kPairs == kMorePairs ? half_gap_mm_.data() : few_limits_mm;
  const Two zero = {0, 0}, separation_mm = both(limits_.separation_mm);
  const Slot& slot = slots_[s];
  const ContactPair* const pairs = pairs_.data() + slot.first_pair;
  const std::size_t count = kPairs == kMorePairs ? slots_[s + 1].first_pair - slot.first_pair : kPairs;
  const Two shift_mm = now[s].shift_mm, drive_mm = now[s].drive_mm;

  // Pushes. Gaps and speeds of two neighbours at a time; the sum in ascending order.
  Two wanted = drive_mm;
  Two deepest = zero;
  for (std::size_t p = 0; p < count; ++p) {
    const ContactPair& c = pairs[p];
    const Motion &a = now[c.other[0]], &b = now[c.other[1]];
    const Two a_shift = a.shift_mm - shift_mm, b_shift = b.shift_mm - shift_mm;
    const Two gap = c.gap_mm + (c.normal_x * firsts(a_shift, b_shift) + c.normal_y * seconds(a_shift, b_shift));
    const Two half = larger(0.5 * gap, zero);
    // Along the normal: what the neighbour drives, negative towards this body, and what this body drives.
    const Two theirs = c.normal_x * firsts(a.drive_mm, b.drive_mm) + c.normal_y * seconds(a.drive_mm, b.drive_mm);
    const Two mine = c.normal_x * firsts(drive_mm, drive_mm) + c.normal_y * seconds(drive_mm, drive_mm);
    // They push where they drive faster than both the gap and this body's own retreat allow.
    Two push = larger(smaller(-half, mine) - theirs, zero);
    if constexpr (kWithOverlaps) {
      const Two overlap = gap < -kOverlapTolerance_mm ? -gap : zero;
      deepest = larger(deepest, overlap);
      push += smaller(0.5 * overlap, separation_mm);
      limit_mm[p] = gap;
    } else {
      limit_mm[p] = half;
    }
    wanted -= firsts(push, push) * firsts(c.normal_x, c.normal_y);
    wanted -= seconds(push, push) * seconds(c.normal_x, c.normal_y);
  }
  if constexpr (kWithOverlaps) {
    const Two may_press = 0.5 * larger(deepest, swapped(deepest));
    for (std::size_t p = 0; p < count; ++p) limit_mm[p] = larger(0.5 * (limit_mm[p] + may_press), zero);
  }

  // Both lanes of x, y and their bounds are alike from here on.
  Two low_x = both(-kUnlimited_mm), high_x = both(kUnlimited_mm), low_y = low_x, high_y = high_x;
  if (slot.near_wall) {
    const Two wall = {limits_.x_limit_mm, limits_.y_limit_mm};
    const Two at = Two{bodies.x_mm[slot.body], bodies.y_mm[slot.body]} + shift_mm;
    const Two high = wall - at, low = -wall - at;
    // Outside of a wall it moves inwards, as far as its neighbours let it.
    wanted += larger(smaller(high, zero), -separation_mm) + smaller(larger(low, zero), separation_mm);
    high_x = larger(firsts(high, high), zero);
    high_y = larger(seconds(high, high), zero);
    low_x = smaller(firsts(low, low), zero);
    low_y = smaller(seconds(low, low), zero);
  }
  const double square = wanted[0] * wanted[0] + wanted[1] * wanted[1];
  if (square > limits_.stride_mm * limits_.stride_mm) wanted *= both(limits_.stride_mm / __builtin_sqrt(square));

  // Takes off what is most beyond a limit, and again; what is beyond another limit then scales down all.
  Two x = firsts(wanted, wanted), y = seconds(wanted, wanted);
  x = larger(smaller(x, high_x), low_x);
  y = larger(smaller(y, high_y), low_y);
  double scale = 1;
  for (int round = 0;; ++round) {
    Two excess = zero, normal_x = zero, normal_y = zero;
    for (std::size_t p = 0; p < count; ++p) {
      const Two beyond = pairs[p].normal_x * x + pairs[p].normal_y * y - limit_mm[p];
      const auto worse = beyond > excess;
      excess = larger(beyond, excess);
      normal_x = worse ? pairs[p].normal_x : normal_x;
      normal_y = worse ? pairs[p].normal_y : normal_y;
    }
    if (larger(excess, swapped(excess))[0] <= kLimitTolerance_mm) break;
    if (round == kLimitRounds) {
      for (std::size_t p = 0; p < count; ++p) {
        const Two closing = pairs[p].normal_x * x + pairs[p].normal_y * y;
        for (int k = 0; k < 2; ++k) {
          const double limit = limit_mm[p][k];
          if (closing[k] > limit + kLimitTolerance_mm && scale * closing[k] > limit) scale = limit / closing[k];
        }
      }
      break;
    }
    const auto of_first = firsts(excess, excess) >= seconds(excess, excess);
    excess = larger(excess, swapped(excess));
    x -= excess * (of_first ? firsts(normal_x, normal_x) : seconds(normal_x, normal_x));
    y -= excess * (of_first ? firsts(normal_y, normal_y) : seconds(normal_y, normal_y));
    x = larger(smaller(x, high_x), low_x);
    y = larger(smaller(y, high_y), low_y);
  }

  after_[s].shift_mm = shift_mm + both(scale) * firsts(x, y);
  after_[s].drive_mm = both(slot.cos_turn) * drive_mm + Two{-slot.sin_turn, slot.sin_turn} * swapped(drive_mm);
}

}  // namespace kilotwin::physics

// Finds the contacts that are possible within a tick, and the bodies that own bodies depend on.
#include <algorithm>

#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

constexpr double kOverlapSquare_mm2 = (kDiameter_mm - kOverlapTolerance_mm) * (kDiameter_mm - kOverlapTolerance_mm);

}  // namespace

void ContactSolver::search_all(const Bodies& bodies, const std::vector<std::uint8_t>& own,
                               const std::vector<std::uint8_t>& own_movable) {
  const auto count = static_cast<std::uint32_t>(bodies.size());
  const auto movables = static_cast<std::uint32_t>(movables_.size());
  has_others_ = !own.empty();
  hops_.assign(count + movables, 0);
  for (std::uint32_t i = 0; i < own.size(); ++i) hops_[i] = own[i] != 0 ? 0 : kOutOfReach;
  for (std::uint32_t m = 0; m < movables && has_others_; ++m)
    hops_[count + m] = own_movable[m] != 0 ? 0 : kOutOfReach;
  overlaps_.assign(count, 0);
  slot_of_.assign(count, ContactPass::kStill);
  movers_.clear();
  reached_.clear();
  movable_pass_.clear();
  other_count_ = 0;
  any_overlap_ = false;
  for (std::uint32_t m = 0; m < movables && has_others_; ++m) {
    if (own_movable[m] != 0) reach_neighbours(m, 0);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    if (hops_[i] == 0 && may_be_touched(i)) search(bodies, i);
  }
  for (std::uint32_t m = 0; m < movables; ++m) {
    if (!has_others_ || own_movable[m] != 0) search_movable(m);
  }
  for (std::size_t k = 0; k < reached_.size(); ++k) {
    const std::uint32_t i = reached_[k];
    if (hops_[i] < limits_.sub_steps) {
      i < count ? search(bodies, i) : search_movable(i - count);
    } else if (i < count ? in_motion_[i] != 0 : movable_in_motion_[i - count] != 0) {
      // It stays where it is, but its velocity at the tick's start affects its neighbours.
      if (i < count) {
        movers_.push_back({i, 0, 0, 0});
      } else {
        movable_pass_.add(i - count, 0);
      }
    }
  }
}

/// A sleeping body stays asleep unless a neighbour is driven, moved or overlaps.
bool ContactSolver::may_be_touched(std::uint32_t i) const {
  if (active_[i] != 0) return true;
  for (const std::uint32_t j : candidates_.of(i)) {
    if (active_[j] != 0) return true;
  }
  const auto [begin, end] = specials_of(i);
  return std::any_of(begin, end,
                     [&](const Special& s) { return s.movable != kNone && movable_in_motion_[s.movable] != 0; });
}

void ContactSolver::reach(std::uint32_t node, std::uint8_t hops) {
  if (hops_[node] != kOutOfReach) return;
  hops_[node] = hops;
  reached_.push_back(node);
  const auto count = static_cast<std::uint32_t>(active_.size());
  if (node >= count) reach_neighbours(node - count, hops);
}

/// All movable bodies that may touch each other form a single hop.
void ContactSolver::reach_neighbours(std::uint32_t m, std::uint8_t hops) {
  const auto count = static_cast<std::uint32_t>(active_.size());
  movable_pass_.for_each_near(m, movables_, [&](std::uint32_t other) { reach(count + other, hops); });
}

void ContactSolver::search_movable(std::uint32_t m) {
  if (movable_in_motion_[m] == 0) return;
  const auto count = static_cast<std::uint32_t>(active_.size());
  movable_pass_.add(m, limits_.sub_steps - hops_[count + m]);
  if (!has_others_) return;
  const auto next = static_cast<std::uint8_t>(hops_[count + m] + 1);
  for (const std::uint32_t k : touching_[m]) reach(specials_[k].body, next);
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
  int overlaps = 0, beside_moving = in_motion_[i];
  for (const std::uint32_t j : candidates) {
    const double dx = bodies.x_mm[j] - x, dy = bodies.y_mm[j] - y, square = dx * dx + dy * dy;
    const int within = square <= cutoff_square_mm2;
    others[contacts] = j;
    contacts += static_cast<std::uint32_t>(within);
    overlaps |= square < kOverlapSquare_mm2;
    beside_moving |= within & in_motion_[j];
  }
  const std::uint32_t discs = contacts, count = static_cast<std::uint32_t>(bodies.size());
  for (const Special* s = special; s != special_end; ++s) {
    others[contacts++] = count + static_cast<std::uint32_t>(s - specials_.data());
    overlaps |= s->gap_mm < -kOverlapTolerance_mm;
    beside_moving |= s->movable != kNone && movable_in_motion_[s->movable] != 0;
  }
  overlaps_[i] = static_cast<std::uint8_t>(overlaps);
  if ((contacts == 0 && !limits_.near_wall(x, y, 0)) || bodies.tracked[i] != 0 || immobile_[bodies.robot[i]] != 0)
    return;
  if ((overlaps | beside_moving) == 0 && !limits_.outside(x, y)) return;
  any_overlap_ |= overlaps != 0;
  movers_.push_back({i, static_cast<std::uint32_t>(first), contacts, contacts});
  other_count_ = first + contacts;
  if (!has_others_) return;
  const auto next = static_cast<std::uint8_t>(hops_[i] + 1);
  for (std::uint32_t p = 0; p < discs; ++p) reach(others[p], next);
  for (const Special* s = special; s != special_end; ++s) {
    if (s->movable != kNone) reach(count + s->movable, next);
  }
}

}  // namespace kilotwin::physics

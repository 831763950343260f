// Assigns bodies to lanes of batches, and warm-starts the lanes.
#include <algorithm>
#include <utility>

#include "core/base/state_hash.hpp"
#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

std::uint64_t slip_hash(std::uint32_t robot, double x_mm, double y_mm) {
  return entity_hash(HashDomain::kContact, robot, {hash_bits(x_mm), hash_bits(y_mm)});
}
std::uint64_t contact_hash(std::uint32_t robot, std::uint32_t other, double normal_impulse_mm,
                           double tangent_impulse_mm) {
  return entity_hash(HashDomain::kContact, robot,
                     {other, hash_bits(normal_impulse_mm), hash_bits(tangent_impulse_mm), 1});
}

}  // namespace
namespace {

/// Slots stay assigned while no body has moved farther, mm: half the skin less a reserve for rounding.
constexpr double kMostSlotMotion_mm = 0.499 * kSkin_mm;

}  // namespace

void ContactSolver::update_slots(const Bodies& bodies) {
  if (slots_are_kept_ && slot_robot_ == bodies.robot &&
      !pass_.kernel().any_moved(bodies.x_mm.data(), bodies.y_mm.data(), slot_x_mm_.data(), slot_y_mm_.data(),
                                bodies.size(), kMostSlotMotion_mm * kMostSlotMotion_mm)) {
    return;
  }
  const bool same_robots = slots_are_kept_ && slot_robot_ == bodies.robot;
  if (same_robots) {
    pass_.keep_previous();
    previous_slot_of_ = slot_of_;
  } else {
    release_slots();
  }
  candidates_.update(bodies);
  const auto count = static_cast<std::uint32_t>(bodies.size());
  hops_.assign(count, 0);
  slot_of_.assign(count, ContactPass::kStill);
  movers_.clear();
  specials_.clear();
  movable_pass_.clear();
  other_count_ = 0;
  has_others_ = false;
  for (std::uint32_t i = 0; i < count; ++i) list_near(bodies, i);
  assign_slots();
  pass_.rest();
  fill_batches(bodies, kSkin_mm, same_robots);
  slot_robot_ = bodies.robot;
  slot_x_mm_ = bodies.x_mm;
  slot_y_mm_ = bodies.y_mm;
  slots_are_kept_ = true;
}

void ContactSolver::list_near(const Bodies& bodies, std::uint32_t i) {
  if (bodies.tracked[i] != 0 || immobile_[bodies.robot[i]] != 0) return;
  const double x = bodies.x_mm[i], y = bodies.y_mm[i], reach_mm = limits_.cutoff_mm + kSkin_mm;
  const auto candidates = candidates_.of(i);
  if (others_.size() <= other_count_ + candidates.size())
    others_.resize(2 * (other_count_ + candidates.size() + 1));
  // First the neighbours within the cutoff, then the others; both ascending.
  const double cutoff_square_mm2 = pass_limits_.cutoff_square_mm2;
  std::uint32_t* const others = others_.data() + other_count_;
  far_.resize(candidates.size() + 1);
  std::uint32_t near = 0, far = 0;
  for (const std::uint32_t j : candidates) {
    const double dx = bodies.x_mm[j] - x, dy = bodies.y_mm[j] - y, square = dx * dx + dy * dy;
    const int is_near = square <= cutoff_square_mm2, is_listed = square <= reach_mm * reach_mm;
    others[near] = j;
    far_[far] = j;
    near += static_cast<std::uint32_t>(is_near);
    far += static_cast<std::uint32_t>(is_listed & ~is_near);
  }
  std::copy_n(far_.begin(), far, others + near);
  const std::uint32_t contacts = near + far;
  if (contacts == 0 && !limits_.near_wall(x, y, kSkin_mm)) {
    cache_.clear(bodies.robot[i]);  // It touches nothing.
    return;
  }
  movers_.push_back({i, static_cast<std::uint32_t>(other_count_), contacts, near});
  other_count_ += contacts;
}

void ContactSolver::assign_slots() {
  // Sort by number of contacts, so that the lanes of a batch have similar work. Equal numbers stay in the order of hops.
  std::array<std::uint32_t, kMostContacts + 2> end{};
  const auto key = [](const Mover& m) { return std::min(m.near, kMostContacts); };
  for (const Mover& m : movers_) ++end[key(m) + 1];
  for (std::size_t k = 1; k < end.size(); ++k) end[k] += end[k - 1];
  slot_movers_.resize(movers_.size());
  for (const Mover& m : movers_) slot_movers_[end[key(m)]++] = m;

  pass_.clear();
  for (std::size_t at = 0; at < slot_movers_.size(); at += kLanes) {
    const std::size_t size = std::min(kLanes, slot_movers_.size() - at);
    std::uint32_t contacts = 0, hops = limits_.sub_steps;
    for (std::size_t lane = 0; lane < size; ++lane) {
      contacts = std::max(contacts, slot_movers_[at + lane].contacts);
      hops = std::min<std::uint32_t>(hops, hops_[slot_movers_[at + lane].body]);
    }
    pass_.add_batch(contacts, limits_.sub_steps - hops);
    for (std::size_t lane = 0; lane < size; ++lane) slot_of_[slot_movers_[at + lane].body] = pass_.slot(lane);
  }
}

/// Gives the points of contact on movable bodies slots of their own. Only their body moves them.
void ContactSolver::assign_point_slots() {
  std::size_t lane = kLanes;
  for (Special& special : specials_) {
    if (special.movable == kNone || !movable_pass_.has(special.movable)) continue;
    if (lane == kLanes) {
      pass_.add_batch(0, 0);
      lane = 0;
    }
    special.slot = pass_.slot(lane++);
  }
}

void ContactSolver::fill_batches(const Bodies& bodies, double more_mm, bool warm_start) {
  std::size_t at = 0;
  for (std::size_t b = 1; at < slot_movers_.size(); ++b, at += kLanes) {
    ContactBatch& batch = pass_.batch(b);
    batch.size = static_cast<std::uint32_t>(std::min(kLanes, slot_movers_.size() - at));
    bool special = false;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const bool is_body = lane < batch.size;
      const Mover mover = is_body ? slot_movers_[at + lane] : Mover{slot_movers_[at].body, 0, 0, 0};
      const std::uint32_t i = mover.body;
      batch.body[lane] = i;
      // A body at the last hop contributes its velocity only.
      if (warm_start) {
        warm_start_lane(lane, mover, batch);
      } else if (is_body && (mover.contacts > 0 || hops_[i] == limits_.sub_steps)) {
        const CachedContacts& cached = cache_[bodies.robot[i]];
        batch.slip_x_mm[lane] = cached.slip_x_mm;
        batch.slip_y_mm[lane] = cached.slip_y_mm;
      }
      batch.near_wall |= limits_.near_wall(bodies.x_mm[i], bodies.y_mm[i], more_mm);
      special |= mover.contacts > 0 && others_[mover.first + mover.contacts - 1] >= bodies.size();
      if (!warm_start) fill_lane(bodies, lane, mover, batch);
      fill_rest(lane, mover, batch);
    }
    if (special) pass_.make_special(batch);
  }
}

/// Fills in the neighbours of a lane, and their impulses from the cache.
void ContactSolver::fill_lane(const Bodies& bodies, std::size_t lane, const Mover& mover, ContactBatch& batch) {
  ContactLanes* const contacts = pass_.contacts_of(batch);
  const CachedContacts& cached = cache_[bodies.robot[mover.body]];
  std::uint32_t p = 0;
  for (; p < mover.contacts; ++p) {
    const std::uint32_t j = others_[mover.first + p];
    if (j >= bodies.size()) break;  // Shapes other than discs come last.
    const std::uint32_t id = bodies.robot[j];
    double normal_impulse_mm = 0, tangent_impulse_mm = 0;
    if (cached.contacts != 0) {
      const CachedContacts::Contact own = cached.contact_with(id);
      normal_impulse_mm = own.normal_impulse_mm;
      tangent_impulse_mm = own.tangent_impulse_mm;
    } else if (cache_.any(id)) {
      // Both robots cache a contact's impulses, unless one of them touched nothing until the last tick.
      const CachedContacts::Contact theirs = cache_[id].contact_with(bodies.robot[mover.body]);
      normal_impulse_mm = theirs.normal_impulse_mm;
      tangent_impulse_mm = theirs.tangent_impulse_mm;
    }
    contacts[p].normal_impulse_mm[lane] = normal_impulse_mm;
    contacts[p].tangent_impulse_mm[lane] = tangent_impulse_mm;
    contacts[p].gap_mm[lane] = p < mover.near ? 0 : kNoContact_mm;
    contacts[p].other[lane] = slot_of_[j];
    contacts[p].there[lane] = j;
  }
  batch.discs[lane] = p;
}

/// Fills in neighbours, impulses and slip from the body's previous slot.
void ContactSolver::warm_start_lane(std::size_t lane, const Mover& mover, ContactBatch& batch) {
  ContactLanes* const contacts = pass_.contacts_of(batch);
  const Slot slot = mover.contacts > 0 ? previous_slot_of_[mover.body] : ContactPass::kStill;
  const std::size_t old_lane = ContactPass::lane_of(slot);
  const ContactBatch& old_batch = pass_.previous_batch_of(slot);
  const ContactLanes* const old = pass_.previous_contacts_of(old_batch);
  const auto old_contacts = static_cast<std::uint32_t>(old_batch.discs[old_lane]);
  batch.slip_x_mm[lane] = old_batch.slip_x_mm[old_lane];
  batch.slip_y_mm[lane] = old_batch.slip_y_mm[old_lane];
  batch.discs[lane] = mover.contacts;
  for (std::uint32_t p = 0; p < mover.contacts; ++p) {
    const std::uint32_t j = others_[mover.first + p];
    std::uint32_t q = 0;
    while (q < old_contacts && old[q].there[old_lane] != j) ++q;
    const bool is_old = q < old_contacts;
    contacts[p].normal_impulse_mm[lane] = is_old ? old[q].normal_impulse_mm[old_lane] : 0;
    contacts[p].tangent_impulse_mm[lane] = is_old ? old[q].tangent_impulse_mm[old_lane] : 0;
    contacts[p].gap_mm[lane] = p < mover.near ? 0 : kNoContact_mm;
    contacts[p].other[lane] = slot_of_[j];
    contacts[p].there[lane] = j;
  }
}

/// Puts the contacts of each body within the cutoff first, ascending: impulses are summed in this order.
void ContactSolver::order_contacts(const ContactBatch& batch) {
  ContactLanes* const contacts = pass_.contacts_of(batch);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const auto follows = [&](std::uint32_t p, std::uint32_t q) {
      const bool p_is_far = contacts[p].gap_mm[lane] == kNoContact_mm,
                 q_is_far = contacts[q].gap_mm[lane] == kNoContact_mm;
      return p_is_far != q_is_far ? p_is_far : contacts[p].there[lane] > contacts[q].there[lane];
    };
    const auto discs = static_cast<std::uint32_t>(batch.discs[lane]);
    for (std::uint32_t p = 1; p < discs; ++p) {
      for (std::uint32_t q = p; q > 0 && follows(q - 1, q); --q) {
        ContactLanes &low = contacts[q - 1], &high = contacts[q];
        std::swap(low.normal_impulse_mm[lane], high.normal_impulse_mm[lane]);
        std::swap(low.tangent_impulse_mm[lane], high.tangent_impulse_mm[lane]);
        std::swap(low.gap_mm[lane], high.gap_mm[lane]);
        std::swap(low.other[lane], high.other[lane]);
        std::swap(low.there[lane], high.there[lane]);
      }
    }
  }
}

/// Fills unused contacts of a lane: any disc except the body's own serves as the other.
void ContactSolver::fill_rest(std::size_t lane, const Mover& mover, ContactBatch& batch) {
  ContactLanes* const contacts = pass_.contacts_of(batch);
  auto p = static_cast<std::uint32_t>(batch.discs[lane]);
  const std::uint32_t last = static_cast<std::uint32_t>(slot_of_.size()) - 1;
  const std::uint32_t any = p > 0 ? contacts[0].there[lane] : mover.body == 0 ? last : 0;
  for (; p < batch.contacts; ++p) {
    contacts[p].normal_impulse_mm[lane] = contacts[p].tangent_impulse_mm[lane] = 0;
    contacts[p].gap_mm[lane] = kNoContact_mm;
    contacts[p].other[lane] = ContactPass::kStill;
    contacts[p].there[lane] = any;
  }
}

/// Two bodies at the same position separate along x, the lower id to the left.
void ContactSolver::separate_lane(const Bodies& bodies, std::size_t lane, const ContactBatch& batch,
                                  ContactLanes* contacts) const {
  const std::uint32_t i = batch.body[lane];
  for (std::uint32_t p = 0; p < static_cast<std::uint32_t>(batch.discs[lane]); ++p) {
    const std::uint32_t j = contacts[p].there[lane];
    if (bodies.x_mm[j] != bodies.x_mm[i] || bodies.y_mm[j] != bodies.y_mm[i]) continue;
    contacts[p].normal_x[lane] = j < i ? -1 : 1;
    contacts[p].normal_y[lane] = 0;
  }
}

/// Copies the contacts of a slot into the cache. Returns whether they changed, or the body slips.
bool ContactSolver::store_contacts(std::uint32_t robot, const Mover& m) const {
  const Slot slot = slot_of_[m.body];
  const ContactBatch& batch = pass_.batch_of(slot);
  const std::size_t lane = ContactPass::lane_of(slot);
  const ContactLanes* const contacts = pass_.contacts_of(batch);
  const auto count = static_cast<std::uint32_t>(slot_robot_.size());
  return cache_.change(robot, [&](CachedContacts& kept) {
    const double slip_x = batch.slip_x_mm[lane], slip_y = batch.slip_y_mm[lane];
    bool changed = kept.slip_x_mm != slip_x || kept.slip_y_mm != slip_y;
    kept.slip_x_mm = slip_x;
    kept.slip_y_mm = slip_y;
    std::uint32_t n = 0;
    for (std::uint32_t p = 0; p < m.contacts && n < CachedContacts::kMost; ++p) {
      const double normal_impulse_mm = contacts[p].normal_impulse_mm[lane];
      if (!(normal_impulse_mm > 0)) continue;
      const bool is_disc = p < static_cast<std::uint32_t>(batch.discs[lane]);
      const std::uint32_t entry = is_disc ? contacts[p].there[lane] : others_[m.first + p];
      const CachedContacts::Contact contact{normal_impulse_mm,
                                            entry < count ? contacts[p].tangent_impulse_mm[lane] : 0,
                                            entry < count ? slot_robot_[entry] : specials_[entry - count].key};
      changed |= !(kept.contact[n] == contact);
      kept.contact[n++] = contact;
    }
    changed |= kept.contacts != n;
    kept.contacts = n;
    return changed || slip_x != 0 || slip_y != 0;
  });
}

void ContactSolver::store_cache() const {
  if (cache_is_current_) return;
  cache_is_current_ = true;
  for (const Mover& m : slot_movers_) store_contacts(slot_robot_[m.body], m);
}

/// Reads slots while they are newer than the cache, so that a hash does not fill the cache in each tick.
std::uint64_t ContactSolver::hash_contacts(const std::vector<std::uint32_t>& robots) const {
  std::uint64_t sum = 0;
  if (cache_is_current_) {
    for (const std::uint32_t robot : robots) {
      if (!cache_.any(robot)) continue;
      const CachedContacts& cached = cache_[robot];
      sum += slip_hash(robot, cached.slip_x_mm, cached.slip_y_mm);
      for (std::uint32_t p = 0; p < cached.contacts; ++p)
        sum += contact_hash(robot, cached.contact[p].other, cached.contact[p].normal_impulse_mm,
                            cached.contact[p].tangent_impulse_mm);
    }
    return sum;
  }
  for (std::size_t b = 1; b < pass_.batches(); ++b) {
    const ContactBatch& batch = pass_.batch(b);
    const ContactLanes* const contacts = pass_.contacts_of(batch);
    for (std::size_t lane = 0; lane < batch.size; ++lane) {
      const std::uint32_t robot = slot_robot_[batch.body[lane]];
      bool any = batch.slip_x_mm[lane] != 0 || batch.slip_y_mm[lane] != 0;
      for (std::uint32_t p = 0; p < batch.contacts; ++p) {
        const ContactLanes& c = contacts[p];
        if (!(c.normal_impulse_mm[lane] > 0)) continue;
        any = true;
        sum +=
            contact_hash(robot, slot_robot_[c.there[lane]], c.normal_impulse_mm[lane], c.tangent_impulse_mm[lane]);
      }
      if (any) sum += slip_hash(robot, batch.slip_x_mm[lane], batch.slip_y_mm[lane]);
    }
  }
  return sum;
}

void ContactSolver::release_slots() {
  store_cache();
  slots_are_kept_ = false;
}

/// A batch rests if none of its bodies, and no neighbour of them, is driven or awake.
void ContactSolver::rest_idle_batches() {
  const bool all_active = active_count_ == active_.size();
  for (std::size_t b = 1; b < pass_.batches(); ++b) {
    ContactBatch& batch = pass_.batch(b);
    int active = all_active;
    const auto look = [&](const std::uint32_t(&bodies)[kLanes]) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) active |= active_[bodies[lane]];
    };
    if (active == 0) look(batch.body);
    const ContactLanes* const contacts = pass_.contacts_of(batch);
    for (std::uint32_t p = 0; p < batch.contacts && active == 0; ++p) look(contacts[p].there);
    batch.passes = limits_.sub_steps;
    if (active == 0) pass_.rest(b);
  }
}

}  // namespace kilotwin::physics

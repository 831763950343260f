#include "services/physics/contact.hpp"

#include <algorithm>

namespace kilotwin::physics {
namespace {

constexpr double kDiameter_mm = 2 * kRobotRadius_mm;
constexpr double kOverlapSquare_mm2 = (kDiameter_mm - kOverlapTolerance_mm) * (kDiameter_mm - kOverlapTolerance_mm);

/// Where a lane has no contact: so far away that it never acts.
constexpr double kNoContact_mm = 1e100;

}  // namespace

ContactLimits::ContactLimits(const RunPlan& plan, const DriveModel& drive)
    : sub_steps(std::clamp(plan.experiment().physics().sub_steps(), 1u, 4u)) {
  const double steps = sub_steps;
  const double sub_step_s = plan.tick_length.seconds() / steps;
  separation_mm = kSeparation_mm_s * sub_step_s;
  stride_mm = std::max(separation_mm, drive.top_speed_mm_s() * sub_step_s);
  // A pair closes by at most 2 strides in a sub-step, and where half of its gap is more than a stride it does not matter. So
  // it matters in sub-step s = 1..S only if its gap is at most 2 s strides at the tick's start.
  cutoff_mm = kDiameter_mm + 2 * steps * stride_mm;
  // A hop per sub-step, each as far as a pair matters in it, and the way of a body that leaves the rectangle in this tick.
  margin_mm = steps * kDiameter_mm + steps * (steps + 1) * stride_mm + steps * stride_mm;
  x_limit_mm = plan.experiment().arena().width_mm() / 2 - kRobotRadius_mm;
  y_limit_mm = plan.experiment().arena().height_mm() / 2 - kRobotRadius_mm;
}

bool ContactLimits::outside(double x_mm, double y_mm) const {
  return x_mm > x_limit_mm || x_mm < -x_limit_mm || y_mm > y_limit_mm || y_mm < -y_limit_mm;
}

ContactSolver::ContactSolver(const RunPlan& plan, const DriveModel& drive)
    : limits_(plan, drive), sub_step_part_(1.0 / limits_.sub_steps), candidates_(limits_.cutoff_mm) {}

bool ContactSolver::find(const Bodies& bodies, const std::vector<std::uint8_t>& own,
                         const std::vector<Duties>& duties) {
  const auto count = static_cast<std::uint32_t>(bodies.size());
  driven_.resize(count);
  active_.resize(count);
  int any_active = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    driven_[i] = duties[i].any();
    active_[i] = driven_[i] | bodies.awake[i];
    any_active |= active_[i];
  }
  if (any_active == 0) return false;

  candidates_.update(bodies);
  has_others_ = !own.empty();
  hops_.assign(count, 0);
  for (std::uint32_t i = 0; i < own.size(); ++i) hops_[i] = own[i] != 0 ? 0 : kOutOfReach;
  overlaps_.assign(count, 0);
  seat_of_.assign(count, ContactPass::kStill);
  movers_.clear();
  reached_.clear();
  other_count_ = 0;
  any_overlap_ = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (hops_[i] == 0 && may_be_touched(i)) search(bodies, i);
  }
  for (std::size_t k = 0; k < reached_.size(); ++k) {
    const std::uint32_t i = reached_[k];
    if (hops_[i] < limits_.sub_steps) {
      search(bodies, i);
    } else if (driven_[i] != 0) {
      movers_.push_back({i, 0, 0});
    }
  }
  seat_movers();
  return true;
}

/// A sleeping body stays so unless somebody beside it is driven, moved or overlaps.
bool ContactSolver::may_be_touched(std::uint32_t i) const {
  if (active_[i] != 0) return true;
  for (const std::uint32_t j : candidates_.of(i)) {
    if (active_[j] != 0) return true;
  }
  return false;
}

void ContactSolver::search(const Bodies& bodies, std::uint32_t i) {
  const double x = bodies.x_mm[i], y = bodies.y_mm[i], cutoff_square_mm2 = limits_.cutoff_mm * limits_.cutoff_mm;
  const auto candidates = candidates_.of(i);
  const std::size_t first = other_count_;
  if (others_.size() < first + candidates.size() + 1) others_.resize(2 * (first + candidates.size() + 1));
  std::uint32_t* const others = others_.data() + first;
  std::uint32_t contacts = 0;
  int overlaps = 0, beside_driven = 0;
  for (const std::uint32_t j : candidates) {
    const double dx = bodies.x_mm[j] - x, dy = bodies.y_mm[j] - y, square = dx * dx + dy * dy;
    const int within = square <= cutoff_square_mm2;
    others[contacts] = j;
    contacts += static_cast<std::uint32_t>(within);
    overlaps |= square < kOverlapSquare_mm2;
    beside_driven |= within & driven_[j];
  }
  overlaps_[i] = static_cast<std::uint8_t>(overlaps);
  if (contacts == 0 || bodies.tracked[i] != 0) return;
  if ((driven_[i] | overlaps | beside_driven) == 0 && !limits_.outside(x, y)) return;
  any_overlap_ |= overlaps != 0;
  movers_.push_back({i, static_cast<std::uint32_t>(first), contacts});
  other_count_ = first + contacts;
  if (!has_others_) return;
  for (std::uint32_t p = 0; p < contacts; ++p) {
    if (hops_[others[p]] != kOutOfReach) continue;
    hops_[others[p]] = static_cast<std::uint8_t>(hops_[i] + 1);
    reached_.push_back(others[p]);
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
  pass_.rest();
}

void ContactSolver::fill_contacts(const Bodies& bodies) {
  const double way_mm = limits_.sub_steps * limits_.stride_mm;
  const double x_free_mm = limits_.x_limit_mm - way_mm, y_free_mm = limits_.y_limit_mm - way_mm;
  for (std::size_t at = 0; at < seated_.size(); at += kLanes) {
    ContactPass::Batch& batch = pass_.batch_of(seat_of_[seated_[at].body]);
    const std::size_t size = std::min(kLanes, seated_.size() - at);
    Mover movers[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane < size) {
        movers[lane] = seated_[at + lane];
      } else {
        movers[lane] = {seated_[at].body, 0, 0};  // The last batch is filled up.
      }
      const double x = bodies.x_mm[movers[lane].body], y = bodies.y_mm[movers[lane].body];
      batch.x_mm[lane] = x;
      batch.y_mm[lane] = y;
      batch.near_wall |= x > x_free_mm || x < -x_free_mm || y > y_free_mm || y < -y_free_mm;
    }
    fill_contacts(bodies, batch, movers);
  }
}

void ContactSolver::fill_contacts(const Bodies& bodies, const ContactPass::Batch& batch, const Mover* movers) {
  std::uint32_t here[kLanes];
  for (std::size_t lane = 0; lane < kLanes; ++lane) here[lane] = movers[lane].body;
  const Lanes x = gather(bodies.x_mm.data(), here), y = gather(bodies.y_mm.data(), here);
  ContactPass::Contact* const contacts = pass_.contacts_of(batch);
  for (std::uint32_t p = 0; p < batch.contacts; ++p) {
    std::uint32_t there[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      there[lane] = p < movers[lane].contacts ? others_[movers[lane].first + p] : here[lane];
    }
    const Lanes dx = gather(bodies.x_mm.data(), there) - x, dy = gather(bodies.y_mm.data(), there) - y;
    const Lanes distance = root(dx * dx + dy * dy), inverse = all(1) / distance;
    ContactPass::Contact& contact = contacts[p];
    contact.normal_x = dx * inverse;
    contact.normal_y = dy * inverse;
    contact.gap_mm = distance - all(kDiameter_mm);
    for (std::size_t lane = 0; lane < kLanes; ++lane) contact.other[lane] = seat_of_[there[lane]];
    if (!(smallest(distance) > 0)) fill_coincident(contact, distance, here, there);
  }
}

void ContactSolver::fill_coincident(ContactPass::Contact& contact, const Lanes& distance_mm,
                                    const std::uint32_t* here, const std::uint32_t* there) {
  double distance[kLanes], gap[kLanes], normal_x[kLanes], normal_y[kLanes];
  store(distance_mm, distance);
  store(contact.gap_mm, gap);
  store(contact.normal_x, normal_x);
  store(contact.normal_y, normal_y);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (distance[lane] > 0) continue;
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
}

void ContactSolver::move(Bodies& bodies, const Drives& drives) {
  for (std::size_t d = 0; d < drives.count; ++d) {
    const std::uint32_t i = drives.body[d];
    const ContactPass::Seat seat = seat_of_[i];
    if (seat == ContactPass::kStill) {
      move_alone(bodies, i, drives.x_mm[d], drives.y_mm[d]);
    } else {
      ContactPass::Batch& batch = pass_.batch_of(seat);
      batch.cos_turn[ContactPass::lane_of(seat)] = drives.cos_turn[d];
      batch.sin_turn[ContactPass::lane_of(seat)] = drives.sin_turn[d];
      pass_.set_drive(seat, drives.x_mm[d], drives.y_mm[d]);
    }
    bodies.heading_rad[i] = wrapped(drives.heading_rad[d] + drives.turn_rad[d]);
  }
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (hops_[i] != 0) {
      bodies.awake[i] = hops_[i] != kOutOfReach;
    } else if (bodies.awake[i] != 0 && driven_[i] == 0 && seat_of_[i] == ContactPass::kStill) {
      move_alone(bodies, i, 0, 0);
    }
  }
  if (seated_.empty()) return;
  fill_contacts(bodies);
  pass_.run(limits_, any_overlap_);
  for (const Mover& m : seated_) {
    if (hops_[m.body] != 0) continue;
    const double x = bodies.x_mm[m.body], y = bodies.y_mm[m.body];
    double to_x = x + pass_.shift_x_mm(seat_of_[m.body]), to_y = y + pass_.shift_y_mm(seat_of_[m.body]);
    if (!limits_.outside(x, y)) {  // The sum is rounded, a wall is not.
      to_x = std::clamp(to_x, -limits_.x_limit_mm, limits_.x_limit_mm);
      to_y = std::clamp(to_y, -limits_.y_limit_mm, limits_.y_limit_mm);
    }
    place(bodies, m.body, to_x, to_y);
  }
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

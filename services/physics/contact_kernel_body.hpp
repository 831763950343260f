/// The inner loops of contact. A source includes this file and is compiled for one instruction set. contact.hpp states the
/// method.
#pragma once

#include "services/physics/contact_constants.hpp"
#include "services/physics/lanes.hpp"

namespace kilotwin::physics {
namespace {

/// Tolerance of a limit for rounding, mm. Without it, sliding at a gap of 0 would stop.
constexpr double kLimitTolerance_mm = 1e-14;
/// Number of a body's limits that are met exactly, the most violated first. Remaining violations scale the displacement down.
constexpr int kLimitRounds = 2;

Start begin(const PassLimits& limits, bool kept, const BodyColumns& bodies, ContactBatch& batch,
            ContactLanes* contacts, double* rows) {
  const Lanes zero = all(0), one = all(1), diameter_mm = all(kDiameter_mm), cutoff = all(limits.cutoff_square_mm2);
  const Lanes no_contact = all(kNoContact_mm), rim_mm_per_turn = all(limits.rim_mm_per_turn_rad);
  const Lanes x = gather(bodies.x_mm, batch.body), y = gather(bodies.y_mm, batch.body);
  const Lanes turn = gather(bodies.turn_rad, batch.body), discs = load(batch.discs);
  Lanes nearest = no_contact, newest = zero;
  std::uint32_t used = 0;
  for (std::size_t p = 0; p < batch.contacts; ++p) {
    ContactLanes& contact = contacts[p];
    const Lanes dx = gather(bodies.x_mm, contact.there) - x, dy = gather(bodies.y_mm, contact.there) - y;
    const Lanes square = dx * dx + dy * dy, distance = root(square), inverse = one / distance;
    const auto is_contact = discs > all(static_cast<double>(p)), is_far = square > cutoff;
    const auto within = [&](Lanes v, Lanes otherwise) {
      return chosen(is_contact, chosen(is_far, otherwise, v), otherwise);
    };
    store(chosen(is_contact, dx * inverse, one), contact.normal_x);
    store(chosen(is_contact, dy * inverse, zero), contact.normal_y);
    const Lanes gap = within(distance - diameter_mm, no_contact);
    newest = larger(newest, load(contact.gap_mm) - gap);
    if (any_above(no_contact, gap)) used = static_cast<std::uint32_t>(p) + 1;
    store(gap, contact.gap_mm);
    store(within(load(contact.normal_impulse_mm), zero), contact.normal_impulse_mm);
    store(within(load(contact.tangent_impulse_mm), zero), contact.tangent_impulse_mm);
    // Both bodies of a contact compute the same bits.
    store((turn + gather(bodies.turn_rad, contact.there)) * rim_mm_per_turn, contact.spin_mm);
    nearest = smaller(nearest, within(distance, no_contact));
  }
  Lanes slip_x = load(batch.slip_x_mm), slip_y = load(batch.slip_y_mm);
  if (kept) {
    slip_x = chosen(no_contact > nearest, slip_x, zero);
    slip_y = chosen(no_contact > nearest, slip_y, zero);
    store(slip_x, batch.slip_x_mm);
    store(slip_y, batch.slip_y_mm);
  }
  const Lanes drive_x = gather(bodies.drive_x_mm, batch.body), drive_y = gather(bodies.drive_y_mm, batch.body);
  const Columns start = {zero, zero, drive_x + slip_x, drive_y + slip_y};
  put_rows(start, rows);
  store(x, batch.x_mm);
  store(y, batch.y_mm);
  store(drive_x, batch.drive_x_mm);
  store(drive_y, batch.drive_y_mm);
  store(zero, batch.shift_x_mm);
  store(zero, batch.shift_y_mm);
  store(start.c, batch.extrapolated_x_mm);
  store(start.d, batch.extrapolated_y_mm);
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    batch.grip_mm[lane] = limits.grip_mm[bodies.driven[batch.body[lane]]];
  store(gather(bodies.cos_turn, batch.body), batch.cos_turn);
  store(gather(bodies.sin_turn, batch.body), batch.sin_turn);
  batch.used = batch.special ? batch.contacts : used;
  return {-largest(-nearest), any_above(newest, all(kNoContact_mm / 2))};
}

/// Largest number of contacts for which the loop below is unrolled, so that its values stay in registers.
constexpr std::size_t kUnrolled = 4;

/// Values of each contact of a batch within a pass: in registers, or in memory for large counts.
template <std::size_t kCount> struct ContactValues {
  ContactValues(const ContactLanes*, double*) {}
  Lanes normal_x[kCount], normal_y[kCount], room_mm[kCount];

  void set_normal(std::size_t p, Lanes x, Lanes y) {
    normal_x[p] = x;
    normal_y[p] = y;
  }
  void set_room(std::size_t p, Lanes v) { room_mm[p] = v; }
  [[nodiscard]] Lanes x(std::size_t p) const { return normal_x[p]; }
  [[nodiscard]] Lanes y(std::size_t p) const { return normal_y[p]; }
  [[nodiscard]] Lanes room(std::size_t p) const { return room_mm[p]; }
};
template <> struct ContactValues<0> {
  const ContactLanes* contacts;
  double* room_mm;

  void set_normal(std::size_t, Lanes, Lanes) {}
  void set_room(std::size_t p, Lanes v) { store(v, room_mm + p * kLanes); }
  [[nodiscard]] Lanes x(std::size_t p) const { return load(contacts[p].normal_x); }
  [[nodiscard]] Lanes y(std::size_t p) const { return load(contacts[p].normal_y); }
  [[nodiscard]] Lanes room(std::size_t p) const { return load(room_mm + p * kLanes); }
};

/// `kCount`: number of contacts of a batch that is not special; 0: read the number from the batch.
template <bool kWithOverlaps, std::size_t kCount>
// NOLINTNEXTLINE(readability-function-size): one loop, whose values stay in registers
inline void move(const PassLimits& limits, ContactBatch& batch, ContactLanes* contacts,
                 const SpecialLanes* specials, const double* motion, double* after, double* room_mm) {
  const std::size_t count = kCount > 0 ? kCount : batch.used;
  const Lanes zero = all(0), a_half = all(0.5), separation_mm = all(limits.separation_mm);
  const Lanes touch_mm = all(limits.touch_mm), ease = all(kEase), tangent_gain = all(kTangentGain);
  const Lanes disc_gain = all(kGain), disc_friction = all(limits.friction), tolerance_mm = all(kLimitTolerance_mm);
  const bool special = kCount == 0 && batch.special;
  const Lanes shift_x = load(batch.shift_x_mm), shift_y = load(batch.shift_y_mm);
  const Lanes extrapolated_x = load(batch.extrapolated_x_mm), extrapolated_y = load(batch.extrapolated_y_mm);
  const Lanes drive_x = load(batch.drive_x_mm), drive_y = load(batch.drive_y_mm);
  const Lanes old_slip_x = load(batch.slip_x_mm), old_slip_y = load(batch.slip_y_mm);

  // Impulses of the contacts, summed in ascending order.
  ContactValues<kCount> of{contacts, room_mm};
  Lanes slip_x = old_slip_x, slip_y = old_slip_y, apart_x = zero, apart_y = zero, deepest = zero;
#pragma GCC unroll 4
  for (std::size_t p = 0; p < count; ++p) {
    ContactLanes& c = contacts[p];
    const Columns other = rows(motion, c.other);
    const Lanes normal_x = load(c.normal_x), normal_y = load(c.normal_y);
    of.set_normal(p, normal_x, normal_y);
    const Lanes gap = load(c.gap_mm) + (normal_x * (other.a - shift_x) + normal_y * (other.b - shift_y));
    const Lanes closing = normal_x * (extrapolated_x - other.c) + normal_y * (extrapolated_y - other.d);
    const Lanes gain = special ? load(specials[p].gain) : disc_gain;
    const Lanes friction = special ? load(specials[p].friction) : disc_friction;
    const Lanes normal_impulse =
        larger(load(c.normal_impulse_mm) + gain * (closing - ease * larger(gap - touch_mm, zero)), zero);
    // Sliding of the rims along the normal turned left. Both bodies compute the same bits.
    const Lanes sliding =
        (normal_x * (extrapolated_y - other.d) - normal_y * (extrapolated_x - other.c)) + load(c.spin_mm);
    const Lanes most = friction * normal_impulse;
    const Lanes tangent_impulse = larger(smaller(load(c.tangent_impulse_mm) + tangent_gain * sliding, most), -most);
    store(normal_impulse, c.normal_impulse_mm);
    store(tangent_impulse, c.tangent_impulse_mm);
    slip_x = slip_x - normal_impulse * normal_x + tangent_impulse * normal_y;
    slip_y = slip_y - normal_impulse * normal_y - tangent_impulse * normal_x;
    if constexpr (kWithOverlaps) {
      const Lanes overlap = chosen(all(-kOverlapTolerance_mm) > gap, -gap, zero);
      deepest = larger(deepest, overlap);
      const Lanes apart = smaller(a_half * overlap, separation_mm);
      apart_x = apart_x - apart * normal_x;
      apart_y = apart_y - apart * normal_y;
      of.set_room(p, gap);
    } else {
      of.set_room(p, larger(a_half * gap, zero));
    }
  }
  // The ground removes as much of the slip as its grip allows.
  const Lanes grip = load(batch.grip_mm), slip = root(slip_x * slip_x + slip_y * slip_y);
  const Lanes keep = chosen(slip > grip, (slip - grip) / slip, zero);
  slip_x = slip_x * keep;
  slip_y = slip_y * keep;
  Lanes x = drive_x + slip_x, y = drive_y + slip_y;
  if constexpr (kWithOverlaps) {
#pragma GCC unroll 4
    for (std::size_t p = 0; p < count; ++p) of.set_room(p, larger(a_half * (of.room(p) + a_half * deepest), zero));
  }

  Lanes low_x = zero, low_y = zero, high_x = zero, high_y = zero;
  if (batch.near_wall) {
    const Lanes at_x = load(batch.x_mm) + shift_x, at_y = load(batch.y_mm) + shift_y;
    high_x = all(limits.x_limit_mm) - at_x;
    high_y = all(limits.y_limit_mm) - at_y;
    low_x = all(-limits.x_limit_mm) - at_x;
    low_y = all(-limits.y_limit_mm) - at_y;
    const Lanes most_x = larger(high_x, zero), least_x = smaller(low_x, zero);
    const Lanes most_y = larger(high_y, zero), least_y = smaller(low_y, zero);
    slip_x = slip_x + (larger(smaller(x, most_x), least_x) - x);
    slip_y = slip_y + (larger(smaller(y, most_y), least_y) - y);
    x = larger(smaller(x, most_x), least_x);
    y = larger(smaller(y, most_y), least_y);
    // A body outside a wall moves inwards, as far as its neighbours allow.
    x = x + (larger(smaller(high_x, zero), -separation_mm) + smaller(larger(low_x, zero), separation_mm));
    y = y + (larger(smaller(high_y, zero), -separation_mm) + smaller(larger(low_y, zero), separation_mm));
    high_x = larger(high_x, zero);
    high_y = larger(high_y, zero);
    low_x = smaller(low_x, zero);
    low_y = smaller(low_y, zero);
  }
  const Lanes velocity_x = drive_x + slip_x, velocity_y = drive_y + slip_y;
  if constexpr (kWithOverlaps) {
    x = x + apart_x;
    y = y + apart_y;
  }
  const Lanes square = x * x + y * y, stride = all(limits.stride_mm), stride_square = stride * stride;
  if (any_above(square, stride_square)) {
    const Lanes shortening = chosen(square > stride_square, stride / root(square), all(1));
    x = x * shortening;
    y = y * shortening;
  }

  // Removes the excess beyond the most violated limit, twice; then scales down to meet the others. There are no branches,
  // so that the processor works on several batches at a time.
  const auto hold_at_walls = [&] {
    if (!batch.near_wall) return;
    x = larger(smaller(x, high_x), low_x);
    y = larger(smaller(y, high_y), low_y);
  };
  const auto along = [&](std::size_t p) { return of.x(p) * x + of.y(p) * y; };
  hold_at_walls();
  for (int round = 0; round < kLimitRounds; ++round) {
    Lanes normal_x = zero, normal_y = zero, excess = zero;
#pragma GCC unroll 4
    for (std::size_t p = 0; p < count; ++p) {
      const Lanes beyond = along(p) - of.room(p);
      const auto worse = beyond > excess;
      excess = larger(excess, beyond);
      normal_x = chosen(worse, of.x(p), normal_x);
      normal_y = chosen(worse, of.y(p), normal_y);
    }
    excess = chosen(excess > tolerance_mm, excess, zero);
    x = x - excess * normal_x;
    y = y - excess * normal_y;
    hold_at_walls();
  }
  Lanes scale = all(1);
#pragma GCC unroll 4
  for (std::size_t p = 0; p < count; ++p) {
    const Lanes way = along(p), limit = of.room(p);
    const auto missed = (way > limit + tolerance_mm) & (scale * way > limit);
    scale = chosen(missed, limit / way, scale);
  }
  x = scale * x;
  y = scale * y;

  const Lanes cos_turn = load(batch.cos_turn), sin_turn = load(batch.sin_turn);
  const Columns next = {shift_x + x, shift_y + y, (velocity_x + velocity_x) - (drive_x + old_slip_x),
                        (velocity_y + velocity_y) - (drive_y + old_slip_y)};
  put_rows(next, after);
  store(next.a, batch.shift_x_mm);
  store(next.b, batch.shift_y_mm);
  store(next.c, batch.extrapolated_x_mm);
  store(next.d, batch.extrapolated_y_mm);
  store(slip_x, batch.slip_x_mm);
  store(slip_y, batch.slip_y_mm);
  store(cos_turn * drive_x - sin_turn * drive_y, batch.drive_x_mm);
  store(sin_turn * drive_x + cos_turn * drive_y, batch.drive_y_mm);
}

template <bool kWithOverlaps>
void pass_over(const PassLimits& limits, std::uint32_t step, ContactBatch* batches, std::size_t count,
               ContactLanes* contacts, const SpecialLanes* specials, const double* now, double* after,
               double* room_mm) {
  for (std::size_t b = 0; b < count; ++b) {
    ContactBatch& batch = batches[b];
    if (step >= batch.passes) continue;
    ContactLanes* const own = contacts + batch.first_contact;
    const SpecialLanes* const special = specials + batch.first_special;
    double* const to = after + b * kLanes * 4;
    switch (batch.special ? 0 : batch.used) {
      case 1: move<kWithOverlaps, 1>(limits, batch, own, special, now, to, room_mm); break;
      case 2: move<kWithOverlaps, 2>(limits, batch, own, special, now, to, room_mm); break;
      case 3: move<kWithOverlaps, 3>(limits, batch, own, special, now, to, room_mm); break;
      case kUnrolled: move<kWithOverlaps, kUnrolled>(limits, batch, own, special, now, to, room_mm); break;
      default: move<kWithOverlaps, 0>(limits, batch, own, special, now, to, room_mm);
    }
  }
}

void pass(const PassLimits& limits, std::uint32_t step, bool overlap, ContactBatch* batches, std::size_t count,
          ContactLanes* contacts, const SpecialLanes* specials, const double* now, double* after, double* room_mm) {
  (overlap ? pass_over<true> : pass_over<false>)(limits, step, batches, count, contacts, specials, now, after,
                                                 room_mm);
}

/// Moves the first eight bodies of these columns.
inline void move_eight_free(const PassLimits& limits, const double* drive_x_mm, const double* drive_y_mm,
                            const double* cos_turn, const double* sin_turn, const double* turn_rad, double* x_mm,
                            double* y_mm, double* heading_rad) {
  constexpr double kBelowPi = 0x1.921fb54442d17p+1;  // the double below the one nearest to pi
  const Lanes cosine = load(cos_turn), sine = load(sin_turn), pi = all(0x1.921fb54442d18p+1), whole_turn = pi + pi;
  Lanes x = load(drive_x_mm), y = load(drive_y_mm), shift_x = x, shift_y = y;
  for (std::uint32_t step = 1; step < limits.sub_steps; ++step) {
    const Lanes next_x = cosine * x - sine * y;
    y = sine * x + cosine * y;
    x = next_x;
    shift_x = shift_x + x;
    shift_y = shift_y + y;
  }
  store(load(x_mm) + shift_x, x_mm);
  store(load(y_mm) + shift_y, y_mm);
  Lanes heading = load(heading_rad) + load(turn_rad);
  while (any_above(heading, all(kBelowPi)))
    heading = chosen(heading > all(kBelowPi), heading - whole_turn, heading);
  while (any_above(-pi, heading)) heading = chosen(-pi > heading, heading + whole_turn, heading);
  store(heading, heading_rad);
}

void move_free(const PassLimits& limits, const BodyColumns& bodies, double* x_mm, double* y_mm, double* heading_rad,
               std::size_t count) {
  const auto eight = [&](std::size_t i, double* x, double* y, double* heading) {
    move_eight_free(limits, bodies.drive_x_mm + i, bodies.drive_y_mm + i, bodies.cos_turn + i, bodies.sin_turn + i,
                    bodies.turn_rad + i, x, y, heading);
  };
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) eight(i, x_mm + i, y_mm + i, heading_rad + i);
  if (i == count) return;
  double last[3][kLanes] = {};
  const std::size_t octets = (count - i) * sizeof(double);
  __builtin_memcpy(last[0], x_mm + i, octets);
  __builtin_memcpy(last[1], y_mm + i, octets);
  __builtin_memcpy(last[2], heading_rad + i, octets);
  eight(i, last[0], last[1], last[2]);
  __builtin_memcpy(x_mm + i, last[0], octets);
  __builtin_memcpy(y_mm + i, last[1], octets);
  __builtin_memcpy(heading_rad + i, last[2], octets);
}

bool any_moved(const double* x_mm, const double* y_mm, const double* from_x_mm, const double* from_y_mm,
               std::size_t count, double square_mm2) {
  Lanes farthest = all(0);
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    const Lanes dx = load(x_mm + i) - load(from_x_mm + i), dy = load(y_mm + i) - load(from_y_mm + i);
    farthest = larger(dx * dx + dy * dy, farthest);
  }
  bool moved = largest(farthest) > square_mm2;
  for (; i < count; ++i) {
    const double dx = x_mm[i] - from_x_mm[i], dy = y_mm[i] - from_y_mm[i];
    moved |= dx * dx + dy * dy > square_mm2;
  }
  return moved;
}

}  // namespace
}  // namespace kilotwin::physics

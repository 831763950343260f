#include "services/physics/contact_pass.hpp"

#include "services/physics/contact.hpp"

namespace kilotwin::physics {
namespace {

/// By how much a limit may be missed because of rounding, mm. Sliding at a gap of 0 would stop without it.
constexpr double kLimitTolerance_mm = 1e-14;
/// How many limits of a body are met exactly, the one that is missed most first; what is missed then scales all down.
constexpr int kLimitRounds = 2;
/// By which the friction of a contact grows with what the rims slide. With kGain of contact.cpp: six discs around one, each with
/// six, have 6 (kGain + kRubGain) = 1.26, below the 4/3 up to which the iteration converges (Banert et al., 2023).
constexpr double kRubGain = 0.06;

}  // namespace

void ContactPass::clear() {
  batches_.clear();
  contact_count_ = 0;
  add_batch(0, 0);
}

void ContactPass::add_batch(std::uint32_t contacts, std::uint32_t passes) {
  Batch& batch = batches_.emplace_back();
  batch.first_contact = static_cast<std::uint32_t>(contact_count_);
  batch.contacts = contacts;
  batch.passes = passes;
  contact_count_ += contacts;
  if (contacts_.size() < contact_count_) contacts_.resize(2 * contact_count_);
  if (limit_mm_.size() < contacts) limit_mm_.resize(contacts);
}

void ContactPass::rest() {
  now_.assign(batches_.size() * kColumns * kLanes, 0);
  after_.assign(now_.size(), 0);
}

void ContactPass::set_off() {
  for (std::size_t b = 1; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    double* const now = now_.data() + b * kColumns * kLanes;
    store(load(batch.drive_x_mm) + load(batch.slip_x_mm), now + 2 * kLanes);
    store(load(batch.drive_y_mm) + load(batch.slip_y_mm), now + 3 * kLanes);
    store(load(batch.spin_mm), now + 4 * kLanes);
    store(load(batch.spin_mm), after_.data() + b * kColumns * kLanes + 4 * kLanes);  // It stays the same.
  }
}

template <bool kWithOverlaps> void ContactPass::sub_step(const ContactLimits& limits, std::uint32_t step) {
  for (std::size_t b = 1; b < batches_.size(); ++b) {
    if (step < batches_[b].passes) {
      move<kWithOverlaps>(limits, batches_[b], now_.data() + b * kColumns * kLanes,
                          after_.data() + b * kColumns * kLanes);
    }
  }
}

template <bool kWithOverlaps>
inline void ContactPass::move(const ContactLimits& limits, Batch& batch, const double* now, double* after) {
  const double* const motion = now_.data();
  Contact* const contacts = contacts_.data() + batch.first_contact;
  const std::size_t count = batch.contacts;
  Lanes* const limit_mm = limit_mm_.data();
  const Lanes zero = all(0), a_half = all(0.5), separation_mm = all(limits.separation_mm);
  const Lanes touch_mm = all(limits.touch_mm);
  const Lanes shift_x = load(now), shift_y = load(now + kLanes);
  const Lanes swing_x = load(now + 2 * kLanes), swing_y = load(now + 3 * kLanes);
  const Lanes drive_x = load(batch.drive_x_mm), drive_y = load(batch.drive_y_mm);
  const Lanes spin = load(now + 4 * kLanes), rub_gain = all(kRubGain);
  const Lanes old_slip_x = load(batch.slip_x_mm), old_slip_y = load(batch.slip_y_mm);

  // Forces of the contacts; the sum in ascending order.
  Lanes slip_x = old_slip_x, slip_y = old_slip_y, apart_x = zero, apart_y = zero, deepest = zero;
  for (std::size_t p = 0; p < count; ++p) {
    Contact& c = contacts[p];
    const Lanes gap = c.gap_mm + (c.normal_x * (gather(motion, c.other) - shift_x) +
                                  c.normal_y * (gather(motion + kLanes, c.other) - shift_y));
    const Lanes closing = c.normal_x * (swing_x - gather(motion + 2 * kLanes, c.other)) +
                          c.normal_y * (swing_y - gather(motion + 3 * kLanes, c.other));
    c.push_mm = larger(c.push_mm + c.gain * (closing - all(kEase) * larger(gap - touch_mm, zero)), zero);
    // Of the rims, along the normal turned left: the same number for both bodies, to the last bit.
    const Lanes sliding = (c.normal_x * (swing_y - gather(motion + 3 * kLanes, c.other)) -
                           c.normal_y * (swing_x - gather(motion + 2 * kLanes, c.other))) +
                          (spin + gather(motion + 4 * kLanes, c.other));
    const Lanes most = c.friction * c.push_mm;
    c.rub_mm = larger(smaller(c.rub_mm + rub_gain * sliding, most), -most);
    slip_x = slip_x - c.push_mm * c.normal_x + c.rub_mm * c.normal_y;
    slip_y = slip_y - c.push_mm * c.normal_y - c.rub_mm * c.normal_x;
    if constexpr (kWithOverlaps) {
      const Lanes overlap = chosen(all(-kOverlapTolerance_mm) > gap, -gap, zero);
      deepest = larger(deepest, overlap);
      const Lanes apart = smaller(a_half * overlap, separation_mm);
      apart_x = apart_x - apart * c.normal_x;
      apart_y = apart_y - apart * c.normal_y;
      limit_mm[p] = gap;
    } else {
      limit_mm[p] = larger(a_half * gap, zero);
    }
  }
  // The ground takes off as much of the slip as its grip allows.
  const Lanes grip = load(batch.grip_mm), square_slip = slip_x * slip_x + slip_y * slip_y;
  if (largest(square_slip) > 0) {
    const Lanes slip = root(square_slip), keep = chosen(slip > grip, (slip - grip) / slip, zero);
    slip_x = slip_x * keep;
    slip_y = slip_y * keep;
  }
  Lanes x = drive_x + slip_x, y = drive_y + slip_y;
  if constexpr (kWithOverlaps) {
    for (std::size_t p = 0; p < count; ++p) limit_mm[p] = larger(a_half * (limit_mm[p] + a_half * deepest), zero);
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
    // Outside of a wall it moves inwards, as far as its neighbours let it.
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
  if (largest(square) > limits.stride_mm * limits.stride_mm) {
    const Lanes shortening = chosen(square > stride_square, stride / root(square), all(1));
    x = x * shortening;
    y = y * shortening;
  }

  // Takes off what is most beyond a limit, and again; what is beyond another limit then scales down all.
  const auto hold_at_walls = [&] {
    if (!batch.near_wall) return;
    x = larger(smaller(x, high_x), low_x);
    y = larger(smaller(y, high_y), low_y);
  };
  const auto closing = [&](std::size_t p) { return contacts[p].normal_x * x + contacts[p].normal_y * y; };
  hold_at_walls();
  Lanes excess = zero;
  for (int round = 0; round < kLimitRounds; ++round) {
    Lanes normal_x = zero, normal_y = zero;
    excess = zero;
    for (std::size_t p = 0; p < count; ++p) {
      const Lanes beyond = closing(p) - limit_mm[p];
      const auto worse = beyond > excess;
      excess = larger(excess, beyond);
      normal_x = chosen(worse, contacts[p].normal_x, normal_x);
      normal_y = chosen(worse, contacts[p].normal_y, normal_y);
    }
    if (!(largest(excess) > kLimitTolerance_mm)) break;
    excess = chosen(excess > all(kLimitTolerance_mm), excess, zero);
    x = x - excess * normal_x;
    y = y - excess * normal_y;
    hold_at_walls();
  }
  if (largest(excess) > kLimitTolerance_mm) {
    excess = zero;
    for (std::size_t p = 0; p < count; ++p) excess = larger(excess, closing(p) - limit_mm[p]);
  }
  if (largest(excess) > kLimitTolerance_mm) {
    Lanes scale = all(1);
    for (std::size_t p = 0; p < count; ++p) {
      const Lanes along = closing(p), limit = limit_mm[p];
      const auto missed = (along > limit + all(kLimitTolerance_mm)) & (scale * along > limit);
      scale = chosen(missed, limit / along, scale);
    }
    x = scale * x;
    y = scale * y;
  }

  const Lanes cos_turn = load(batch.cos_turn), sin_turn = load(batch.sin_turn);
  store(shift_x + x, after);
  store(shift_y + y, after + kLanes);
  store((velocity_x + velocity_x) - (drive_x + old_slip_x), after + 2 * kLanes);
  store((velocity_y + velocity_y) - (drive_y + old_slip_y), after + 3 * kLanes);
  store(slip_x, batch.slip_x_mm);
  store(slip_y, batch.slip_y_mm);
  store(cos_turn * drive_x - sin_turn * drive_y, batch.drive_x_mm);
  store(sin_turn * drive_x + cos_turn * drive_y, batch.drive_y_mm);
}

template void ContactPass::sub_step<true>(const ContactLimits&, std::uint32_t);
template void ContactPass::sub_step<false>(const ContactLimits&, std::uint32_t);

}  // namespace kilotwin::physics

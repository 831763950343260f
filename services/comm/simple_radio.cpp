// The radio model of the ARGoS paper (Pinciroli 2018, section 2.3): no clocks, carrier sense or packets in time. A robot that
// holds a message and has not sent for the interval sends it within the tick. Robots in range receive the message, unless
// it is dropped, or lost to another sender of the tick.
#include <algorithm>

#include "services/comm/radio_engine.hpp"

namespace kilotwin::comm {
namespace {

/// Draws of Stream::kReception per receiver and tick, for each sender: drop, loss, and one per rival. With more than 2048
/// senders they repeat.
constexpr std::uint32_t kDrawsPerSender = 64, kDraws = 1u << 17;

}  // namespace

void RadioEngine::exchange_simply(Tick now) {
  const SimpleRadioSettings& model = simple_model_;
  const auto interval = static_cast<Cycles>(model.interval_s * kNominalClockHz);
  const Cycles begin = begin_of(now), end = begin_of(now + 1);
  timers_.begin_tick();
  neighbourhood_.sort();
  sent_.clear();
  receptions_.clear();
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    timers_.pass(i, end);
    if (!is(i, kRunning | kHolding) || next_send_[i] >= end) continue;
    const bool own = owns(i);
    counters_.attempted += own;
    radio_counts_[i].attempted += own;
    if (random_.uniform(Stream::kBackOff, i, now, 0) < model.sending_error) {
      counters_.aborted += own;
      radio_counts_[i].backed_off += own;
      continue;
    }
    next_send_[i] = std::max(next_send_[i], begin) + interval;
    state_[i] &= static_cast<std::uint8_t>(~kHolding);
    sent_.push_back(i);
  }
  for (const std::uint32_t sender : sent_) receive_simply(sender, now);
  std::uint32_t ordinal = 0;
  for (const OverheadController::Copy& copy : overhead_.copies()) {
    if (copy.end() >= begin && copy.end() < end) receive_copy(copy, ordinal++, now);
  }
  receptions_.close();
  if (divided_) std::erase_if(sent_, [this](std::uint32_t i) { return !owns(i); });
}

void RadioEngine::receive_simply(std::uint32_t sender, Tick now) {
  const SimpleRadioSettings& model = simple_model_;
  if (owns(sender)) {
    ++counters_.sent;
    ++radio_counts_[sender].sent;
    log_sent(sender, begin_of(now));
    if (counts_pairs_) pairs_.add(sender, sender);
  }
  receptions_.begin_message(message_[sender], crc_error_[sender]);
  neighbourhood_.visit(sender, [&](std::uint32_t receiver, double square_mm2) {
    if (!is(receiver, kReceptive) || !owns(receiver)) return;
    const auto happens = [&](double probability, std::uint32_t draw) {
      return probability > 0 && random_.uniform(Stream::kReception, receiver, now, draw % kDraws) < probability;
    };
    bool is_lost = false;
    const std::uint32_t first_draw = sender * kDrawsPerSender;
    std::uint32_t draw = first_draw + 2;
    for (const std::uint32_t rival : sent_) {
      if (rival == sender || (rival != receiver && !neighbourhood_.in_range(receiver, rival))) continue;
      is_lost = is_lost || happens(model.contention, draw++);
    }
    if (is_lost) {
      ++counters_.collided;
      ++radio_counts_[receiver].collided;
    } else if (happens(model.drop_probability, first_draw) || happens(loss_, first_draw + 1)) {
      ++counters_.faded;
    } else if (crc_error_[sender] != 0) {
      receptions_.add(receiver, ranging_.gains(__builtin_sqrt(square_mm2)));
    } else {
      ++counters_.received;
      ++radio_counts_[receiver].received;
      log_received(receiver, sender, begin_of(now));
      receptions_.add(receiver, ranging_.gains(__builtin_sqrt(square_mm2)));
      if (counts_pairs_) pairs_.add(receiver, sender);
    }
  });
}

}  // namespace kilotwin::comm

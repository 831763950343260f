// Saves and restores the radio engine.
#include <utility>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"
#include "services/comm/message_octets.hpp"
#include "services/comm/radio_engine.hpp"

namespace kilotwin::comm {
namespace {

constexpr char kAborted = 1, kOrphaned = 2, kOver = 4;

void require(bool condition) {
  if (!condition)
    throw RunError("the radio's part of the checkpoint does not fit the experiment; resume from another one");
}

std::size_t size_of(int size) { return static_cast<std::size_t>(size); }

}  // namespace

void RadioEngine::save(proto::RadioState& part) const {
  KILOTWIN_DEMAND(!divided_);
  part.Clear();
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    part.add_next_interrupt(timers_.time_word(i));
    part.add_timer_counts(timers_.count_word(i));
    part.add_tx_period(tx_period_[i]);
    if (is(i, kHolding)) {
      append(*part.mutable_held_messages(), message_[i]);
      part.add_held_crc_error(crc_error_[i]);
    }
    part.add_robot_attempted(radio_counts_[i].attempted);
    part.add_robot_sent(radio_counts_[i].sent);
    part.add_robot_received(radio_counts_[i].received);
    part.add_robot_collided(radio_counts_[i].collided);
    part.add_robot_backed_off(radio_counts_[i].backed_off);
  }
  part.set_state(std::string(state_.begin(), state_.end()));
  for (const Transmission& x : channel_.all()) {
    part.add_transmission_start(x.start);
    part.add_transmission_end(x.end);
    part.add_transmission_sender(x.sender);
    part.mutable_transmission_flags()->push_back(
        static_cast<char>((x.aborted ? kAborted : 0) | (x.orphaned ? kOrphaned : 0) | (x.over ? kOver : 0)));
    append(*part.mutable_transmission_messages(), x.message);
    part.add_transmission_crc_error(x.crc_error);
  }
  part.mutable_next_send()->Add(next_send_.begin(), next_send_.end());
  overhead_.save(*part.mutable_overhead());
  if (firmware_) firmware_->save(part);
  part.mutable_sent()->Add(sent_.begin(), sent_.end());
  receptions_.save(part);
  part.set_attempted(counters_.attempted);
  part.set_messages_sent(counters_.sent);
  part.set_received(counters_.received);
  part.set_collided(counters_.collided);
  part.set_aborted(counters_.aborted);
  part.set_faded(counters_.faded);
  for (const PairCount& pair : pairs_.all()) {
    part.add_pair_receiver(pair.receiver);
    part.add_pair_sender(pair.sender);
    part.add_pair_count(pair.count);
  }
}

void RadioEngine::load(Tick tick, std::span<const proto::RadioState* const> parts) {
  KILOTWIN_DEMAND(!divided_);
  require(parts.size() == 1);
  const proto::RadioState& part = *parts[0];
  const std::size_t robots = state_.size();
  require(size_of(part.next_interrupt_size()) == robots && size_of(part.timer_counts_size()) == robots &&
          part.state().size() == robots && size_of(part.tx_period_size()) == robots);
  require(size_of(part.next_send_size()) == next_send_.size() && size_of(part.robot_attempted_size()) == robots &&
          size_of(part.robot_sent_size()) == robots && size_of(part.robot_received_size()) == robots &&
          size_of(part.robot_collided_size()) == robots && size_of(part.robot_backed_off_size()) == robots);
  next_send_.assign(part.next_send().begin(), part.next_send().end());
  tick_ = tick;
  std::size_t held = 0;
  for (std::uint32_t i = 0; i < robots; ++i) {
    const auto n = static_cast<int>(i);
    timers_.restore(i, part.next_interrupt(n), part.timer_counts(n));
    state_[i] = static_cast<std::uint8_t>(part.state()[i]);
    tx_period_[i] = static_cast<std::uint16_t>(part.tx_period(n));
    radio_counts_[i] = {part.robot_attempted(n), part.robot_sent(n), part.robot_received(n), part.robot_collided(n),
                        part.robot_backed_off(n)};
    if (!is(i, kHolding)) continue;
    require(std::cmp_less(held, part.held_crc_error_size()));
    crc_error_[i] = static_cast<std::uint16_t>(part.held_crc_error(static_cast<int>(held)));
    message_[i] = message_at(part.held_messages(), held++);
  }
  const int transmissions = part.transmission_start_size();
  require(part.transmission_end_size() == transmissions && part.transmission_sender_size() == transmissions &&
          part.transmission_crc_error_size() == transmissions &&
          part.transmission_flags().size() == size_of(transmissions));
  channel_.all().clear();
  for (int n = 0; n < transmissions; ++n) {
    require(part.transmission_sender(n) < robots);
    const char flags = part.transmission_flags()[size_of(n)];
    channel_.all().push_back({part.transmission_start(n), part.transmission_end(n), part.transmission_sender(n),
                              (flags & kAborted) != 0, (flags & kOrphaned) != 0,
                              message_at(part.transmission_messages(), size_of(n)), (flags & kOver) != 0,
                              static_cast<std::uint16_t>(part.transmission_crc_error(n))});
  }
  overhead_.load(part.overhead());
  if (firmware_) firmware_->load(part);
  sent_.assign(part.sent().begin(), part.sent().end());
  receptions_.load(part);
  counters_ = {part.attempted(), part.messages_sent(), part.received(),
               part.collided(),  part.aborted(),       part.faded()};
  pairs_.clear();
  require(part.pair_sender_size() == part.pair_receiver_size() &&
          part.pair_count_size() == part.pair_receiver_size());
  for (int n = 0; counts_pairs_ && n < part.pair_receiver_size(); ++n) {
    require(part.pair_receiver(n) < robots);
    pairs_.add(part.pair_receiver(n), part.pair_sender(n), part.pair_count(n));
  }
}

void ReceptionLog::save(proto::RadioState& part) const {
  for (const Reception& reception : arrived_) {
    part.add_reception_robot(reception.robot);
    part.add_reception_message(reception.message);
    part.add_reception_high_gain(reception.gains.high);
    part.add_reception_low_gain(reception.gains.low);
  }
  for (const IrMessage& message : messages_) append(*part.mutable_received_messages(), message);
  part.mutable_received_crc_error()->Add(crc_error_.begin(), crc_error_.end());
}

void ReceptionLog::load(const proto::RadioState& part) {
  clear();
  const int receptions = part.reception_robot_size();
  require(part.reception_message_size() == receptions && part.reception_high_gain_size() == receptions &&
          part.reception_low_gain_size() == receptions);
  const std::size_t messages = part.received_messages().size() / IrMessage{}.size();
  require(size_of(part.received_crc_error_size()) == messages);
  for (std::size_t n = 0; n < messages; ++n) {
    messages_.push_back(message_at(part.received_messages(), n));
    crc_error_.push_back(static_cast<std::uint16_t>(part.received_crc_error(static_cast<int>(n))));
  }
  for (int n = 0; n < receptions; ++n) {
    require(part.reception_robot(n) + 1 < first_.size() && part.reception_message(n) < messages);
    arrived_.push_back({part.reception_robot(n),
                        part.reception_message(n),
                        {static_cast<std::int16_t>(part.reception_high_gain(n)),
                         static_cast<std::int16_t>(part.reception_low_gain(n))}});
  }
  close();
}

}  // namespace kilotwin::comm

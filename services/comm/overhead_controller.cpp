#include "services/comm/overhead_controller.hpp"

#include <algorithm>

#include "core/base/state_hash.hpp"
#include "idl/checkpoint.pb.h"
#include "services/comm/message_octets.hpp"

namespace kilotwin::comm {

void OverheadController::command(std::span<const OverheadPacket> packets, Cycles now) {
  next_ = std::max(next_, now);
  waiting_.clear();
  for (const OverheadPacket& packet : packets) {
    repeating_ = packet.command == OverheadCommand::kRepeat;
    if (repeating_) message_ = packet.message;
    if (packet.command != OverheadCommand::kStop) waiting_.push_back(packet.message);
  }
}

void OverheadController::advance(std::span<const OverheadPacket> packets, Cycles begin, Cycles end) {
  while (!packets.empty()) {
    const std::uint32_t offset = packets.front().offset_cycles();
    std::size_t together = 1;
    while (together < packets.size() && packets[together].offset_cycles() == offset) ++together;
    start_copies(begin + offset);
    command(packets.first(together), begin + offset);
    packets = packets.subspan(together);
  }
  start_copies(end);
}

void OverheadController::start_copies(Cycles end) {
  std::size_t sent = 0;
  for (; next_ < end && (sent < waiting_.size() || repeating_); next_ += kOverheadPeriod) {
    copies_.push_back({next_, sent < waiting_.size() ? waiting_[sent++] : message_});
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(sent));
}

void OverheadController::forget(Cycles t) {
  std::erase_if(copies_, [t](const Copy& copy) { return copy.end() <= t; });
}

std::uint64_t OverheadController::hash() const {
  const auto [low, high] = words(message_);
  std::uint64_t sum =
      entity_hash(HashDomain::kRadio, 0xffffffffu,
                  {static_cast<std::uint64_t>(next_), repeating_, repeating_ ? low : 0, repeating_ ? high : 0});
  for (std::uint32_t i = 0; i < waiting_.size(); ++i) {
    const auto [first, second] = words(waiting_[i]);
    sum += entity_hash(HashDomain::kRadio, 0xfffffffeu, {i, first, second});
  }
  return sum;
}

void OverheadController::save(proto::OverheadControllerState& state) const {
  state.set_next(next_);
  state.set_repeating(repeating_);
  append(*state.mutable_message(), message_);
  for (const IrMessage& message : waiting_) append(*state.mutable_waiting(), message);
  for (const Copy& copy : copies_) {
    state.add_copy_start(copy.start);
    append(*state.mutable_copy_messages(), copy.message);
  }
}

void OverheadController::load(const proto::OverheadControllerState& state) {
  next_ = state.next();
  repeating_ = state.repeating();
  message_ = message_at(state.message(), 0);
  waiting_.clear();
  for (std::size_t i = 0; i < state.waiting().size() / message_.size(); ++i)
    waiting_.push_back(message_at(state.waiting(), i));
  copies_.clear();
  for (int i = 0; i < state.copy_start_size(); ++i) {
    copies_.push_back({state.copy_start(i), message_at(state.copy_messages(), static_cast<std::size_t>(i))});
  }
}

}  // namespace kilotwin::comm

#include "clients/ohc/packet_queue.hpp"

#include <algorithm>

namespace kilotwin::ohc {
namespace {

bool acts_by_itself(OverheadCommand command) {
  return command == OverheadCommand::kBootPage || command == OverheadCommand::kGpsFrame ||
         command == OverheadCommand::kLedToggle;
}

}  // namespace

void PacketQueue::put(const OverheadPacket& packet, Time due) {
  if (!queue_.empty()) due = std::max(due, queue_.back().due);
  queue_.push_back({packet, due});
  if (queue_.size() > kMost) drop_first();
}

/// Whether the first packet has waited too long, and another one is due to take its place.
bool PacketQueue::is_outdated(Time now) const {
  return queue_.size() > 1 && queue_[1].due <= now && now - queue_[0].due > kLongestWait &&
         !acts_by_itself(queue_[0].packet.command);
}

void PacketQueue::drop_first() {
  queue_.pop_front();
  ++dropped_;
}

std::optional<OverheadPacket> PacketQueue::take(Time now) {
  while (is_outdated(now)) drop_first();
  if (queue_.empty() || queue_.front().due > now) return std::nullopt;
  const OverheadPacket packet = queue_.front().packet;
  queue_.pop_front();
  return packet;
}

std::optional<PacketQueue::Time> PacketQueue::next_due() const {
  if (queue_.empty()) return std::nullopt;
  return queue_.front().due;
}

void PacketQueue::clear() {
  dropped_ += queue_.size();
  queue_.clear();
}

}  // namespace kilotwin::ohc

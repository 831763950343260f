#include "services/comm/overhead_controller.hpp"

#include <algorithm>

#include "core/base/state_hash.hpp"
#include "idl/checkpoint.pb.h"
#include "services/comm/message_octets.hpp"
#include "services/comm/packet_bits.hpp"

namespace kilotwin::comm {

namespace {

constexpr std::uint8_t kGps = 1, kPagePart = 0x81;  // kilolib's message types
constexpr std::size_t kPageOctets = 128, kPartOctets = 6, kRecordOctets = 8, kRecords = 16;
/// Where so many messages wait, eight pages, further pages and GPS frames are dropped.
constexpr std::size_t kMostWaiting = 176;

}  // namespace

bool OverheadController::Copy::is_sound() const { return crc == message_crc(message); }

void OverheadController::command(std::span<const OverheadPacket> packets, Cycles now) {
  next_ = std::max(next_, now);
  std::erase_if(waiting_, [](const Item& item) { return item.pace == kOverheadPeriod; });
  for (const OverheadPacket& packet : packets) {
    repeating_ = packet.command == OverheadCommand::kRepeat || packet.command == OverheadCommand::kRaw;
    enqueue(packet);
  }
}

void OverheadController::enqueue(const OverheadPacket& packet) {
  std::uint16_t crc = message_crc(packet.message);
  switch (packet.command) {
    case OverheadCommand::kStop:
    case OverheadCommand::kLedToggle: return;
    case OverheadCommand::kBootPage: return add_page(packet);
    case OverheadCommand::kGpsFrame: return add_gps_frame(packet);
    case OverheadCommand::kRaw: crc = static_cast<std::uint16_t>(packet.rest[0] | packet.rest[1] << 8); break;
    case OverheadCommand::kRepeat:
    case OverheadCommand::kOnce: break;
  }
  waiting_.push_back({packet.message, crc, kOverheadPeriod});
  if (!repeating_) return;
  message_ = packet.message;
  crc_ = crc;
}

/// Page number, offset in words, six octets; of the last message, two octets are of the page.
void OverheadController::add_page(const OverheadPacket& packet) {
  if (waiting_.size() >= kMostWaiting) return;
  const auto payload = packet.payload();
  for (std::size_t at = 0; at < kPageOctets; at += kPartOctets) {
    IrMessage message{payload[0], static_cast<std::uint8_t>(at / 2)};
    const std::size_t octets = std::min(kPartOctets, kPageOctets - at);
    std::copy_n(payload.begin() + 1 + static_cast<std::ptrdiff_t>(at), octets, message.begin() + 2);
    message.back() = kPagePart;
    waiting_.push_back({message, message_crc(message), kBurstPeriod});
  }
  waiting_.back().pace += kBurstPause;
}

void OverheadController::add_gps_frame(const OverheadPacket& packet) {
  if (waiting_.size() >= kMostWaiting) return;
  const std::size_t before = waiting_.size();
  const auto payload = packet.payload();
  for (std::size_t n = 0; n < kRecords; ++n) {
    const auto record = payload.begin() + static_cast<std::ptrdiff_t>(n * kRecordOctets);
    if (std::all_of(record, record + kRecordOctets, [](std::uint8_t octet) { return octet == 0; })) break;
    IrMessage message{};
    std::copy_n(record, kRecordOctets, message.begin());
    message.back() = kGps;
    waiting_.push_back({message, message_crc(message), kBurstPeriod + kGpsPause});
  }
  if (waiting_.size() > before) waiting_.back().pace += kBurstPause;
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
  while (next_ < end && (sent < waiting_.size() || repeating_)) {
    const Item item = sent < waiting_.size() ? waiting_[sent++] : Item{message_, crc_, kOverheadPeriod};
    copies_.push_back({next_, item.message, item.crc});
    next_ += item.pace;
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(sent));
}

void OverheadController::forget(Cycles t) {
  std::erase_if(copies_, [t](const Copy& copy) { return copy.end() <= t; });
}

/// A message with a right CRC at the usual pace counts as its octets alone.
std::uint64_t OverheadController::hash() const {
  const auto wrong = [](const IrMessage& message, std::uint16_t crc) {
    return static_cast<std::uint64_t>(crc ^ message_crc(message)) << 16;
  };
  const auto [low, high] = words(message_);
  std::uint64_t sum = entity_hash(HashDomain::kRadio, 0xffffffffu,
                                  {static_cast<std::uint64_t>(next_), repeating_, repeating_ ? low : 0,
                                   repeating_ ? high | wrong(message_, crc_) : 0});
  for (std::uint32_t i = 0; i < waiting_.size(); ++i) {
    const Item& item = waiting_[i];
    const auto [first, second] = words(item.message);
    const auto pace = static_cast<std::uint64_t>(item.pace ^ kOverheadPeriod) << 32;
    sum += entity_hash(HashDomain::kRadio, 0xfffffffeu, {i, first, second | wrong(item.message, item.crc) | pace});
  }
  return sum;
}

void OverheadController::save(proto::OverheadControllerState& state) const {
  state.set_next(next_);
  state.set_repeating(repeating_);
  append(*state.mutable_message(), message_);
  state.set_crc(crc_);
  for (const Item& item : waiting_) {
    append(*state.mutable_waiting(), item.message);
    state.add_waiting_crc(item.crc);
    state.add_waiting_pace(item.pace);
  }
  for (const Copy& copy : copies_) {
    state.add_copy_start(copy.start);
    append(*state.mutable_copy_messages(), copy.message);
    state.add_copy_crc(copy.crc);
  }
}

void OverheadController::load(const proto::OverheadControllerState& state) {
  const auto shorter = [](Cycles pace) { return pace < kPacket; };
  if (state.waiting_pace_size() != state.waiting_crc_size() || state.copy_crc_size() != state.copy_start_size() ||
      std::any_of(state.waiting_pace().begin(), state.waiting_pace().end(), shorter))
    throw RunError("the overhead controller's part of the checkpoint is damaged; resume from another one");
  next_ = state.next();
  repeating_ = state.repeating();
  message_ = message_at(state.message(), 0);
  crc_ = static_cast<std::uint16_t>(state.crc());
  waiting_.clear();
  for (int i = 0; i < state.waiting_crc_size(); ++i) {
    waiting_.push_back({message_at(state.waiting(), static_cast<std::size_t>(i)),
                        static_cast<std::uint16_t>(state.waiting_crc(i)), state.waiting_pace(i)});
  }
  copies_.clear();
  for (int i = 0; i < state.copy_start_size(); ++i) {
    copies_.push_back({state.copy_start(i), message_at(state.copy_messages(), static_cast<std::size_t>(i)),
                       static_cast<std::uint16_t>(state.copy_crc(i))});
  }
}

}  // namespace kilotwin::comm

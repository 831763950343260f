#include "services/ark/message_queue.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

constexpr MessageQueue::Cycles kNever = -1;
constexpr auto kDelayBin = static_cast<MessageQueue::Cycles>(kDelayBin_s * kNominalClockHz);
constexpr std::uint32_t kDataBits = 10, kDataMask = (1u << kDataBits) - 1;

}  // namespace

MessageQueue::MessageQueue(std::uint32_t robots, const std::vector<EnvironmentSettings>& environments,
                           Cycles robot_interval)
    : robots_(environments.empty() ? 0 : robots),
      environments_(static_cast<std::uint32_t>(environments.size())),
      robot_interval_(robot_interval),
      word_(std::size_t{robots_} * environments_, 0),
      asked_(std::size_t{robots_} * environments_, kNever),
      served_(robots_, -robot_interval),
      next_environment_(robots_, 0) {
  for (const EnvironmentSettings& environment : environments) {
    if (environment.bits) fields_.push_back(*environment.bits);
  }
  counts_.delays.assign(kDelayBins, 0);
}

void MessageQueue::put(std::uint32_t environment, const ArkMessage& message, Cycles now) {
  const auto word = static_cast<std::uint16_t>(message.type << kDataBits | message.payload);
  if (!fields_.empty() && word >> fields_[environment].count != 0) {
    ++counts_.too_wide;
    return;
  }
  const std::size_t i = slot(message.id, environment);
  word_[i] = word;
  if (asked_[i] == kNever)
    asked_[i] = now;
  else
    ++counts_.replaced;
}

std::optional<MessageQueue::Cycles> MessageQueue::earliest() const {
  std::optional<Cycles> first;
  if (!broadcasts_.empty()) first = 0;
  for (std::uint32_t robot = 0; robot < robots_; ++robot) {
    const auto ready = this->ready(robot);
    if (ready && (!first || *ready < *first)) first = ready;
  }
  return first;
}

std::optional<MessageQueue::Cycles> MessageQueue::ready(std::uint32_t robot) const {
  std::optional<Cycles> first;
  for (std::uint32_t e = 0; e < environments_; ++e) {
    const Cycles asked = asked_[slot(robot, e)];
    if (asked != kNever && (!first || asked < *first)) first = asked;
  }
  if (first) first = std::max(*first, served_[robot] + robot_interval_);
  return first;
}

void MessageQueue::count_delay(Cycles asked, Cycles now) {
  const auto delay = static_cast<std::size_t>((now - asked) / kDelayBin);
  ++counts_.delays[std::min(delay, kDelayBins - 1)];
}

ArkMessage MessageQueue::serve(std::uint32_t robot, Cycles now) {
  ++counts_.robot_messages;
  served_[robot] = now;
  std::uint32_t word = 0;
  if (fields_.empty()) {
    std::uint32_t& environment = next_environment_[robot];
    while (asked_[slot(robot, environment)] == kNever) environment = (environment + 1) % environments_;
    word = word_[slot(robot, environment)];
    count_delay(asked_[slot(robot, environment)], now);
    asked_[slot(robot, environment)] = kNever;
    environment = (environment + 1) % environments_;
  } else {
    Cycles first = now;
    for (std::uint32_t e = 0; e < environments_; ++e) {
      Cycles& asked = asked_[slot(robot, e)];
      word |= std::uint32_t{word_[slot(robot, e)]} << fields_[e].first;
      if (asked != kNever) first = std::min(first, asked);
      asked = kNever;
    }
    count_delay(first, now);
  }
  return {static_cast<std::uint16_t>(robot), static_cast<std::uint8_t>(word >> kDataBits),
          static_cast<std::uint16_t>(word & kDataMask)};
}

std::optional<IrMessage> MessageQueue::take(Cycles now) {
  if (!broadcasts_.empty()) {
    const IrMessage message = broadcasts_.front();
    broadcasts_.erase(broadcasts_.begin());
    ++counts_.packets;
    ++counts_.broadcasts;
    return message;
  }
  struct Candidate {
    Cycles ready;
    std::uint32_t robot;
  };
  std::array<Candidate, kArkSlots> first{};
  std::size_t count = 0;
  for (std::uint32_t robot = 0; robot < robots_; ++robot) {
    const auto ready = this->ready(robot);
    if (!ready || *ready > now) continue;
    if (count == kArkSlots && first.back().ready <= *ready) continue;
    std::size_t place = count < kArkSlots ? count++ : kArkSlots - 1;
    for (; place > 0 && first[place - 1].ready > *ready; --place) first[place] = first[place - 1];
    first[place] = {*ready, robot};
  }
  if (count == 0) return std::nullopt;
  std::array<ArkMessage, kArkSlots> messages;
  for (std::size_t i = 0; i < count; ++i) messages[i] = serve(first[i].robot, now);
  ++counts_.packets;
  return pack(std::span(messages).first(count));
}

std::uint64_t MessageQueue::word() const {
  HashState hash(robots_);
  for (const std::uint16_t word : word_) hash.add(word);
  for (const Cycles asked : asked_) hash.add(static_cast<std::uint64_t>(asked));
  for (const Cycles served : served_) hash.add(static_cast<std::uint64_t>(served));
  for (const std::uint32_t environment : next_environment_) hash.add(environment);
  for (const IrMessage& broadcast : broadcasts_) {
    for (const std::uint8_t octet : broadcast) hash.add(octet);
  }
  return hash.finish();
}

void MessageQueue::save(proto::MessageQueueState& state) const {
  for (const std::uint16_t word : word_) state.add_word(word);
  for (const Cycles asked : asked_) state.add_asked_cycle(asked);
  for (const Cycles served : served_) state.add_served_cycle(served);
  for (const std::uint32_t environment : next_environment_) state.add_next_environment(environment);
  for (const IrMessage& broadcast : broadcasts_)
    state.mutable_broadcasts()->append(broadcast.begin(), broadcast.end());
  state.set_packets(counts_.packets);
  state.set_robot_messages(counts_.robot_messages);
  state.set_broadcasts_sent(counts_.broadcasts);
  state.set_replaced(counts_.replaced);
  state.set_too_wide(counts_.too_wide);
  for (const std::uint64_t count : counts_.delays) state.add_delays(count);
}

void MessageQueue::load(const proto::MessageQueueState& state) {
  const auto sized = [](int size, std::size_t right) { return static_cast<std::size_t>(size) == right; };
  bool fits = sized(state.word_size(), word_.size()) && sized(state.asked_cycle_size(), asked_.size()) &&
              sized(state.served_cycle_size(), served_.size()) &&
              sized(state.next_environment_size(), next_environment_.size()) &&
              sized(state.delays_size(), kDelayBins) && state.broadcasts().size() % IrMessage{}.size() == 0;
  for (const std::uint32_t environment : state.next_environment()) fits = fits && environment < environments_;
  if (!fits) throw RunError("the checkpoint is of another station; resume from another one");
  for (int i = 0; i < state.word_size(); ++i) {
    word_[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(state.word(i));
    asked_[static_cast<std::size_t>(i)] = state.asked_cycle(i);
  }
  for (int i = 0; i < state.served_cycle_size(); ++i) {
    served_[static_cast<std::size_t>(i)] = state.served_cycle(i);
    next_environment_[static_cast<std::size_t>(i)] = state.next_environment(i);
  }
  broadcasts_.clear();
  for (std::size_t from = 0; from < state.broadcasts().size(); from += IrMessage{}.size()) {
    IrMessage broadcast{};
    std::copy_n(state.broadcasts().begin() + static_cast<std::ptrdiff_t>(from), broadcast.size(),
                broadcast.begin());
    broadcasts_.push_back(broadcast);
  }
  counts_ = {state.packets(),  state.robot_messages(), state.broadcasts_sent(),
             state.replaced(), state.too_wide(),       {state.delays().begin(), state.delays().end()}};
}

}  // namespace kilotwin::ark

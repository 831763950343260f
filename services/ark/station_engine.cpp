#include "services/ark/station_engine.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/plan/station_settings.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

constexpr std::uint8_t kRunMessage = 0x88;  // kilolib's message types: RUN
constexpr double kArkSecondsPerPacket = 0.05, kShortestPerRobot_s = 1.0;

OverheadPacket run_packet() {
  OverheadPacket packet{OverheadCommand::kRepeat, {}};
  packet.message.back() = kRunMessage;
  return packet;
}

double robot_interval_s(std::uint32_t robots) {
  return std::max(kShortestPerRobot_s, robots * kArkSecondsPerPacket / static_cast<double>(kArkSlots));
}

/// The least whole number of cycles that is not shorter.
std::int64_t cycles_of(double seconds) {
  const double cycles = seconds * kNominalClockHz;
  const auto whole = static_cast<std::int64_t>(cycles);
  return whole + static_cast<std::int64_t>(static_cast<double>(whole) < cycles);
}

std::uint64_t word_of(const OverheadPacket& packet, std::size_t from) {
  std::uint64_t word = 0;
  for (std::size_t i = from; i < std::min(from + 8, packet.message.size()); ++i)
    word = word << 8 | packet.message[i];
  return word;
}

}  // namespace

StationEngine::StationEngine(const RunPlan& plan)
    : plan_(plan),
      start_ends_(plan.tick_length.at_or_after(plan.station_settings().start_broadcast_s)),
      packet_interval_(cycles_of(plan.station_settings().packet_interval_s)),
      robot_interval_(cycles_of(robot_interval_s(plan.robots()))),
      tracked_(plan),
      packets_{run_packet()},
      next_packet_(begin_of(start_ends_) +
                   begin_of(plan.tick_length.at_or_after(plan.station_settings().packet_interval_s))),
      measurement_(plan) {
  for (const EnvironmentSettings& description : plan.station_settings().environments) {
    environments_.push_back(make_environment(description, plan.robots()));
  }
  if (!environments_.empty()) {
    served_.resize(plan.robots(), -robot_interval_);
    turns_.resize(plan.robots(), 0);
    seen_.resize(plan.robots());
  }
}

void StationEngine::see(const SwarmView& swarm) {
  if (measurement_.any()) measurement_.measure(swarm, measured_);
  for (std::uint32_t robot = 0; robot < seen_.size(); ++robot) {
    TrackedRobot& seen = seen_[robot];
    seen.robot = robot;
    if (measurement_.any()) {
      seen.p_WR = {measured_.x_mm[robot], measured_.y_mm[robot], measured_.heading_rad[robot]};
    } else {
      seen.p_WR = {swarm.x_mm[robot], swarm.y_mm[robot], swarm.heading_rad[robot]};
    }
    seen.led = swarm.led[robot];
  }
}

void StationEngine::send_own(const SwarmView& swarm) {
  if (now_ == start_ends_ && repeating_) {
    push({OverheadCommand::kStop, {}}, begin_of(now_));
    repeating_ = false;
  } else if (!environments_.empty() && next_packet_ < begin_of(now_ + 1)) {
    send_readings(swarm);
  }
}

void StationEngine::push(const OverheadPacket& packet, Cycles t) {
  packets_.push_back(packet.at(static_cast<std::uint32_t>(t - begin_of(now_))));
}

std::vector<ArkMessage> StationEngine::readings(Cycles t) {
  std::vector<ArkMessage> messages;
  while (messages.size() < kArkSlots && t - served_[next_robot_] >= robot_interval_) {
    VirtualEnvironment& environment = *environments_[turns_[next_robot_] % environments_.size()];
    if (const auto message = environment.sense(seen_[next_robot_])) messages.push_back(*message);
    served_[next_robot_] = t;
    ++turns_[next_robot_];
    next_robot_ = (next_robot_ + 1) % plan_.robots();
  }
  return messages;
}

void StationEngine::send_readings(const SwarmView& swarm) {
  see(swarm);
  Cycles t = std::max(next_packet_, begin_of(now_));
  while (t < begin_of(now_ + 1)) {
    const std::vector<ArkMessage> messages = readings(t);
    if (messages.empty() && !repeating_) {
      // The air is free until somebody's turn comes.
      t = std::max(t + 1, served_[next_robot_] + robot_interval_);
      continue;
    }
    push(messages.empty() ? OverheadPacket{} : OverheadPacket{OverheadCommand::kRepeat, pack(messages)}, t);
    repeating_ = !messages.empty();
    t = next_packet_ = t + packet_interval_;
  }
}

void StationEngine::step(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == now_);
  ++now_;
  tracked_.commit(inputs.memberships);
  packets_.assign(inputs.external.begin(), inputs.external.end());
  if (packets_.empty()) return send_own(inputs.swarm);
  std::stable_sort(packets_.begin(), packets_.end(), [](const OverheadPacket& a, const OverheadPacket& b) {
    return a.offset_cycles() < b.offset_cycles();
  });
  // What the controller does now is not the station's to stop; the next own packet overrides it, an interval later.
  repeating_ = false;
  next_packet_ = std::max(next_packet_, begin_of(now_) + packets_.back().offset_cycles() + packet_interval_);
}

void StationEngine::emit(OverheadFrame& frame) const {
  frame.tick = now_;
  frame.packets.assign(packets_.begin(), packets_.end());
}

std::uint64_t StationEngine::hash_part() const {
  std::uint64_t sum = entity_hash(
      HashDomain::kStation, 0,
      {next_robot_, static_cast<std::uint64_t>(next_packet_ / begin_of(Tick{1})),
       static_cast<std::uint64_t>(next_packet_ % begin_of(Tick{1})) << 1 | static_cast<std::uint64_t>(repeating_),
       packets_.size()});
  for (std::uint32_t i = 0; i < packets_.size(); ++i) {
    sum += entity_hash(HashDomain::kStation, 1 + i,
                       {static_cast<std::uint64_t>(packets_[i].command), word_of(packets_[i], 0),
                        word_of(packets_[i], 8) | std::uint64_t{packets_[i].offset_cycles()} << 16});
  }
  for (std::uint32_t i = 0; i < environments_.size(); ++i) {
    // Apart from the packets, of which there are few.
    constexpr std::uint32_t kEnvironments = 1u << 31;
    if (const std::uint64_t word = environments_[i]->word(); word != 0)
      sum += entity_hash(HashDomain::kStation, kEnvironments + i, {word});
  }
  return sum + tracked_.hash_part();
}

void StationEngine::save(proto::StationState& state) const {
  state.set_next_packet_cycle(next_packet_);
  state.set_repeating_own(repeating_);
  for (const OverheadPacket& packet : packets_) {
    state.mutable_packets()->push_back(static_cast<char>(packet.command));
    state.mutable_packets()->append(packet.message.begin(), packet.message.end());
    state.add_packet_offset_cycles(packet.offset_cycles());
  }
  for (const Cycles served : served_) state.add_served_cycle(served);
  for (const std::uint32_t turns : turns_) state.add_turns(turns);
  for (const auto& environment : environments_) environment->save(*state.add_environment());
  tracked_.save(state);
}

void StationEngine::load(Tick tick, std::span<const proto::StationState* const> parts) {
  constexpr std::size_t kPacketOctets = 11;
  if (parts.size() != 1 || static_cast<std::size_t>(parts[0]->served_cycle_size()) != served_.size() ||
      static_cast<std::size_t>(parts[0]->turns_size()) != turns_.size() ||
      static_cast<std::size_t>(parts[0]->environment_size()) != environments_.size() ||
      parts[0]->packets().size() !=
          kPacketOctets * static_cast<std::size_t>(parts[0]->packet_offset_cycles_size())) {
    throw RunError("the checkpoint holds no station's state of this experiment");
  }
  const proto::StationState& state = *parts[0];
  now_ = tick;
  tracked_.load(tick, state);
  next_packet_ = state.next_packet_cycle();
  repeating_ = state.repeating_own();
  packets_.clear();
  for (const std::uint32_t offset : state.packet_offset_cycles()) {
    const std::size_t from = packets_.size() * kPacketOctets;
    OverheadPacket packet = OverheadPacket{}.at(offset);
    packet.command = static_cast<OverheadCommand>(state.packets()[from]);
    std::copy_n(state.packets().begin() + static_cast<std::ptrdiff_t>(from) + 1, packet.message.size(),
                packet.message.begin());
    packets_.push_back(packet);
  }
  for (std::size_t i = 0; i < served_.size(); ++i) {
    served_[i] = state.served_cycle(static_cast<int>(i));
    turns_[i] = state.turns(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < environments_.size(); ++i)
    environments_[i]->load(state.environment(static_cast<int>(i)));
  // Robots are served in a circle: those before the next one have had one turn more.
  next_robot_ = 0;
  while (next_robot_ < turns_.size() && turns_[next_robot_] > turns_.back()) ++next_robot_;
}

}  // namespace kilotwin::ark

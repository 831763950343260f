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
      packet_ticks_(plan.tick_length.at_or_after(plan.station_settings().packet_interval_s).count()),
      robot_ticks_(plan.tick_length.at_or_after(robot_interval_s(plan.robots())).count()),
      packets_{run_packet()},
      next_packet_(start_ends_ + packet_ticks_),
      measurement_(plan) {
  for (const EnvironmentSettings& description : plan.station_settings().environments) {
    environments_.push_back(make_environment(description, plan.robots()));
  }
  if (!environments_.empty()) {
    served_.resize(plan.robots(), Tick{-robot_ticks_});
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
    packets_.push_back({OverheadCommand::kStop, {}});
    repeating_ = false;
    return;
  }
  if (environments_.empty() || now_ < next_packet_) return;
  std::array<ArkMessage, kArkSlots> messages;
  std::size_t count = 0;
  see(swarm);
  while (count < kArkSlots && now_ - served_[next_robot_] >= robot_ticks_) {
    VirtualEnvironment& environment = *environments_[turns_[next_robot_] % environments_.size()];
    if (const auto message = environment.sense(seen_[next_robot_])) messages[count++] = *message;
    served_[next_robot_] = now_;
    ++turns_[next_robot_];
    next_robot_ = (next_robot_ + 1) % plan_.robots();
  }
  if (count > 0) {
    packets_.push_back({OverheadCommand::kRepeat, pack(std::span(messages).first(count))});
  } else if (repeating_) {
    packets_.push_back({OverheadCommand::kStop, {}});
  } else {
    return;
  }
  repeating_ = count > 0;
  next_packet_ = now_ + packet_ticks_;
}

void StationEngine::step(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == now_);
  ++now_;
  packets_.assign(inputs.external.begin(), inputs.external.end());
  if (packets_.empty()) return send_own(inputs.swarm);
  // What the controller does now is not the station's to stop; the next own packet overrides it, an interval later.
  repeating_ = false;
  next_packet_ = std::max(next_packet_, now_ + packet_ticks_);
}

void StationEngine::emit(OverheadFrame& frame) const {
  frame.tick = now_;
  frame.packets.assign(packets_.begin(), packets_.end());
}

std::uint64_t StationEngine::hash_part() const {
  std::uint64_t sum = entity_hash(HashDomain::kStation, 0,
                                  {next_robot_, static_cast<std::uint64_t>(next_packet_.count()),
                                   static_cast<std::uint64_t>(repeating_), packets_.size()});
  for (std::uint32_t i = 0; i < packets_.size(); ++i) {
    sum += entity_hash(
        HashDomain::kStation, 1 + i,
        {static_cast<std::uint64_t>(packets_[i].command), word_of(packets_[i], 0), word_of(packets_[i], 8)});
  }
  for (std::uint32_t i = 0; i < environments_.size(); ++i) {
    // Apart from the packets, of which there are few.
    constexpr std::uint32_t kEnvironments = 1u << 31;
    if (const std::uint64_t word = environments_[i]->word(); word != 0)
      sum += entity_hash(HashDomain::kStation, kEnvironments + i, {word});
  }
  return sum;
}

void StationEngine::save(proto::StationState& state) const {
  state.set_next_packet_tick(next_packet_.count());
  state.set_repeating_own(repeating_);
  for (const OverheadPacket& packet : packets_) {
    state.mutable_packets()->push_back(static_cast<char>(packet.command));
    state.mutable_packets()->append(packet.message.begin(), packet.message.end());
  }
  for (const Tick served : served_) state.add_served_tick(served.count());
  for (const std::uint32_t turns : turns_) state.add_turns(turns);
  for (const auto& environment : environments_) environment->save(*state.add_environment());
}

void StationEngine::load(Tick tick, std::span<const proto::StationState* const> parts) {
  constexpr std::size_t kPacketOctets = 11;
  if (parts.size() != 1 || static_cast<std::size_t>(parts[0]->served_tick_size()) != served_.size() ||
      static_cast<std::size_t>(parts[0]->turns_size()) != turns_.size() ||
      static_cast<std::size_t>(parts[0]->environment_size()) != environments_.size() ||
      parts[0]->packets().size() % kPacketOctets != 0) {
    throw RunError("the checkpoint holds no station's state of this experiment");
  }
  const proto::StationState& state = *parts[0];
  now_ = tick;
  next_packet_ = Tick{state.next_packet_tick()};
  repeating_ = state.repeating_own();
  packets_.clear();
  for (std::size_t from = 0; from < state.packets().size(); from += kPacketOctets) {
    OverheadPacket packet;
    packet.command = static_cast<OverheadCommand>(state.packets()[from]);
    std::copy_n(state.packets().begin() + static_cast<std::ptrdiff_t>(from) + 1, packet.message.size(),
                packet.message.begin());
    packets_.push_back(packet);
  }
  for (std::size_t i = 0; i < served_.size(); ++i) {
    served_[i] = Tick{state.served_tick(static_cast<int>(i))};
    turns_[i] = state.turns(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < environments_.size(); ++i)
    environments_[i]->load(state.environment(static_cast<int>(i)));
  // Robots are served in a circle: those before the next one have had one turn more.
  next_robot_ = 0;
  while (next_robot_ < turns_.size() && turns_[next_robot_] > turns_.back()) ++next_robot_;
}

}  // namespace kilotwin::ark

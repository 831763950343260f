// The station's state in checkpoints.
#include <optional>

#include "core/base/error.hpp"
#include "core/plan/station_settings.hpp"
#include "idl/checkpoint.pb.h"
#include "services/ark/station_engine.hpp"

namespace kilotwin::ark {

void StationEngine::save(proto::StationState& state) const {
  state.set_next_packet_cycle(next_packet_);
  state.set_repeating_own(repeating_);
  for (const OverheadPacket& packet : packets_) {
    state.add_packets(octets_of(packet));
    state.add_packet_offset_cycles(packet.offset_cycles());
  }
  tracked_.save(state);
  if (uses_queue()) queue_.save(*state.mutable_queue());
  if (plugins_.empty()) return;
  if (camera_) camera_->save(*state.mutable_camera());
  for (std::size_t robot = 0; !camera_ && robot < plan_.robots(); ++robot) {
    state.add_seen_mm(seen_.x_mm[robot]);
    state.add_seen_mm(seen_.y_mm[robot]);
    for (const double value : {seen_.vx_mm[robot], seen_.vy_mm[robot], seen_.heading_rad[robot]})
      state.add_seen_motion(value);
    state.mutable_seen_led()->push_back(static_cast<char>(seen_.led[robot]));
    state.mutable_seen()->push_back(static_cast<char>(seen_.seen[robot]));
  }
  for (const Plugin& plugin : plugins_) {
    proto::EnvironmentState& environment = *state.add_environment();
    environment.set_services(plugin.services);
    environment.set_interval_ms(plugin.interval_ms);
    environment.set_complete(plugin.complete);
    environment.set_word(plugin.word);
    if (!plugin.failure.empty()) environment.set_failure(plugin.failure);
    if (plugin.host == nullptr) continue;
    station::Request request;
    request.call = station::Call::kSave;
    request.tick = now_.count();
    const station::Reply reply = plugin.host->ask(request);
    if (!reply.failure.empty() || !reply.resumable)
      environment.set_not_resumable(true);
    else
      environment.set_state(reply.state);
  }
}

void StationEngine::load(Tick tick, std::span<const proto::StationState* const> parts) {
  if (parts.size() != 1 || static_cast<std::size_t>(parts[0]->environment_size()) != plugins_.size() ||
      parts[0]->packets_size() != parts[0]->packet_offset_cycles_size()) {
    throw RunError("the checkpoint holds no station's state of this experiment");
  }
  const proto::StationState& state = *parts[0];
  now_ = tick;
  tracked_.load(tick, state);
  next_packet_ = state.next_packet_cycle();
  repeating_ = state.repeating_own();
  packets_.clear();
  for (int i = 0; i < state.packets_size(); ++i) {
    const std::optional<OverheadPacket> packet = packet_of(state.packets(i));
    if (!packet) throw RunError("the checkpoint's station holds a damaged packet; resume from another one");
    packets_.push_back(packet->at(state.packet_offset_cycles(i)));
  }
  if (plugins_.empty()) {
    if (hearing_.any()) queue_.load(state.queue());
    return;
  }
  outputs_of_set_up_.clear();
  if (camera_) camera_->load(state.camera());
  if (!camera_) {
    const std::size_t robots = plan_.robots();
    if (static_cast<std::size_t>(state.seen_mm_size()) != 2 * robots || state.seen().size() != robots ||
        static_cast<std::size_t>(state.seen_motion_size()) != 3 * robots || state.seen_led().size() != robots)
      throw RunError("the checkpoint holds no station's state of this experiment");
    for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot) {
      seen_.x_mm[robot] = state.seen_mm(static_cast<int>(2 * robot));
      seen_.y_mm[robot] = state.seen_mm(static_cast<int>(2 * robot + 1));
      const auto motion = [&](std::uint32_t n) { return state.seen_motion(static_cast<int>(3 * robot + n)); };
      seen_.vx_mm[robot] = motion(0);
      seen_.vy_mm[robot] = motion(1);
      seen_.heading_rad[robot] = motion(2);
      seen_.led[robot] = static_cast<LedClass>(state.seen_led()[robot]);
      seen_.seen[robot] = state.seen()[robot] != 0 ? 1 : 0;
    }
  }
  for (std::uint32_t i = 0; i < plugins_.size(); ++i) {
    const proto::EnvironmentState& environment = state.environment(static_cast<int>(i));
    const std::string& name = setting_.environments[i].name;
    if (environment.not_resumable()) {
      throw RunError("the station's plugin " + name +
                     " has no serialize(), so this run cannot be resumed; add it, and run again");
    }
    if (environment.has_failure()) {
      plugins_[i] = {};
      plugins_[i].failure = environment.failure();
    } else {
      set_up(i, true);
      station::Request request = this->request(station::Call::kLoad, tick);
      request.state = environment.state();
      const station::Reply reply = plugins_[i].host ? plugins_[i].host->ask(request) : station::Reply{};
      if (!reply.failure.empty()) throw RunError("the station's plugin " + name + ": " + reply.failure);
    }
    plugins_[i].services = environment.services();
    plugins_[i].interval_ms = environment.interval_ms();
    plugins_[i].complete = environment.complete();
    plugins_[i].word = environment.word();
  }
  queue_.load(state.queue());
  outputs_.clear();
}

}  // namespace kilotwin::ark

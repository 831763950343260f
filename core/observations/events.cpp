#include "core/observations/events.hpp"

#include <fmt/format.h>

#include <iterator>

#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin {
namespace {

/// A value that no LED, motor or life cycle has.
constexpr std::uint32_t kNever = 0xffffffffu;

template <class Value>
void note_changes(Tick tick, proto::RecordedEvent kind, std::size_t robots, Value value,
                  std::vector<std::uint32_t>& last, proto::Observations& to) {
  last.resize(robots, kNever);
  proto::EventRecord* record = nullptr;
  for (std::size_t robot = 0; robot < robots; ++robot) {
    const std::uint32_t now = value(robot);
    if (now == last[robot]) continue;
    last[robot] = now;
    if (record == nullptr) {
      record = to.add_event();
      record->set_tick(tick.count());
      record->set_kind(kind);
    }
    record->add_robot(static_cast<std::uint32_t>(robot));
    record->add_value(now);
  }
}

}  // namespace

RecordedEvents::RecordedEvents(const RunPlan& plan) {
  for (const int kind : plan.manifest().experiment().recording().event()) {
    led = led || kind == proto::LED;
    motion = motion || kind == proto::MOTION;
    state = state || kind == proto::STATE;
    sent = sent || kind == proto::SENT;
    received = received || kind == proto::RECEIVED;
    station = station || kind == proto::STATION;
  }
}

void note_packets(const OverheadFrame& frame, proto::Observations& to) {
  if (frame.packets.empty()) return;
  proto::EventRecord& record = *to.add_event();
  record.set_tick(frame.tick.count());
  record.set_kind(proto::STATION);
  for (const OverheadPacket& packet : frame.packets) {
    record.add_value(static_cast<std::uint32_t>(packet.command));
    record.add_offset_cycles(packet.offset_cycles());
    std::string octets;
    for (const std::uint8_t octet : packet.message) fmt::format_to(std::back_inserter(octets), "{:02x}", octet);
    record.add_text(std::move(octets));
  }
}

void note_failure(Tick tick, std::uint32_t robot, const std::string& text, proto::Observations& to) {
  proto::EventRecord& record = *to.add_event();
  record.set_tick(tick.count());
  record.set_kind(proto::FAILURE);
  record.add_robot(robot);
  record.add_text(text);
}

void ChangeObserver::observe(const SwarmView& swarm, proto::Observations& to) {
  const std::size_t robots = swarm.robots();
  if (recorded_.led) {
    note_changes(
        swarm.tick, proto::LED, robots, [&](std::size_t i) { return std::uint32_t{swarm.led[i]}; }, led_, to);
  }
  if (recorded_.motion) {
    note_changes(
        swarm.tick, proto::MOTION, robots,
        [&](std::size_t i) { return swarm.motor_left[i] | std::uint32_t{swarm.motor_right[i]} << 8; }, motion_, to);
  }
  if (recorded_.state) {
    note_changes(
        swarm.tick, proto::STATE, robots, [&](std::size_t i) { return std::uint32_t{swarm.life_cycle[i]}; }, state_,
        to);
  }
}

void ChangeObserver::take(const proto::EventRecord& earlier, std::uint32_t robots) {
  std::vector<std::uint32_t>* const last = earlier.kind() == proto::LED      ? &led_
                                           : earlier.kind() == proto::MOTION ? &motion_
                                           : earlier.kind() == proto::STATE  ? &state_
                                                                             : nullptr;
  if (last == nullptr) return;
  last->resize(robots, kNever);
  for (int i = 0; i < earlier.robot_size(); ++i) (*last)[earlier.robot(i)] = earlier.value(i);
}

}  // namespace kilotwin

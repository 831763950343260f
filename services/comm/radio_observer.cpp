#include "services/comm/radio_observer.hpp"

#include "idl/recording.pb.h"

namespace kilotwin::comm {
namespace {

/// Where avr-gcc's debug information puts RAM.
constexpr std::uint64_t kRamInDebugInformation = 0x800000, kRamEnd = 0x900;

class FirmwareMemory final : public ProgramMemory {
 public:
  explicit FirmwareMemory(const FirmwareRobots& robots) : robots_(robots) {}
  [[nodiscard]] bool read(std::uint32_t robot, std::uint64_t address, std::span<std::uint8_t> to) const override {
    const std::uint64_t at = address - kRamInDebugInformation;
    if (address < kRamInDebugInformation || at + to.size() > kRamEnd) return false;
    return robots_.read(index_of(robot, robots_), static_cast<std::uint16_t>(at), to);
  }
  [[nodiscard]] std::uint64_t address_of(std::uint32_t, std::uint64_t pointer) const override {
    return kRamInDebugInformation + pointer;
  }

 private:
  const FirmwareRobots& robots_;
};

}  // namespace

RadioObserver::RadioObserver(const RunPlan& plan, RadioEngine& engine)
    : engine_(engine),
      events_(plan),
      sampler_(plan, {0, plan.robots()}, true),
      counters_(plan),
      tick_length_(plan.tick_length) {
  engine.log_messages(events_.sent, events_.received);
}

void RadioObserver::at(Tick now, proto::Observations& to) const {
  counters_.sample(now, engine_.radio_counts(), to);
  if (!sampler_.any() || engine_.firmware() == nullptr) return;
  const FirmwareRobots& robots = *engine_.firmware();
  sampler_.sample(
      now, FirmwareMemory(robots), [&](std::uint32_t robot) { return robots.battery_V(index_of(robot, robots)); },
      to);
}

void RadioObserver::stepped(Tick from, proto::Observations& to) const {
  proto::EventRecord *sent = nullptr, *received = nullptr;
  const auto record_of = [&](proto::EventRecord*& record, proto::RecordedEvent kind) -> proto::EventRecord& {
    if (record == nullptr) {
      record = to.add_event();
      record->set_tick(from.count());
      record->set_kind(kind);
    }
    return *record;
  };
  const Cycles begin = from.count() * static_cast<Cycles>(tick_length_.cycles());
  for (const MessageEvent& event : engine_.logged_messages()) {
    const auto offset = static_cast<std::uint32_t>(std::max<Cycles>(0, event.time - begin));
    if (event.receiver == event.sender) {
      proto::EventRecord& record = record_of(sent, proto::SENT);
      record.add_robot(event.sender);
      record.add_offset_cycles(offset);
      continue;
    }
    proto::EventRecord& record = record_of(received, proto::RECEIVED);
    record.add_robot(event.receiver);
    record.add_sender(event.sender);
    record.add_distance_mm(event.distance_mm);
    record.add_offset_cycles(offset);
  }
}

}  // namespace kilotwin::comm

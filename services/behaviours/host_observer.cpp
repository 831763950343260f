#include "services/behaviours/host_observer.hpp"

#include "core/observations/events.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::behaviours {
namespace {

class HostMemory final : public ProgramMemory {
 public:
  explicit HostMemory(const BehavioursEngine& engine) : engine_(engine) {}
  [[nodiscard]] bool read(std::uint32_t robot, std::uint64_t address, std::span<std::uint8_t> to) const override {
    return engine_.read(robot, address, to);
  }
  [[nodiscard]] std::uint64_t address_of(std::uint32_t robot, std::uint64_t pointer) const override {
    return engine_.offset_of(robot, pointer);
  }

 private:
  const BehavioursEngine& engine_;
};

}  // namespace

HostObserver::HostObserver(const RunPlan& plan, HostId host, const BehavioursEngine& engine)
    : engine_(engine), sampler_(plan, plan.share(host), false), failures_(engine.failures().size()) {}

void HostObserver::at(Tick now, proto::Observations& to) const {
  if (sampler_.any()) sampler_.sample(now, HostMemory(engine_), to);
}

void HostObserver::stepped(Tick from, proto::Observations& to) {
  for (; failures_ < engine_.failures().size(); ++failures_) {
    const auto& failure = engine_.failures()[failures_];
    note_failure(from, failure.robot, failure.text, to);
  }
}

}  // namespace kilotwin::behaviours

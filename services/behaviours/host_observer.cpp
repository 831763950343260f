#include "services/behaviours/host_observer.hpp"

#include "core/observations/events.hpp"
#include "idl/recording.pb.h"
#include "services/behaviours/host_memory.hpp"

namespace kilotwin::behaviours {
HostObserver::HostObserver(const RunPlan& plan, HostId host, const BehavioursEngine& engine)
    : engine_(engine), sampler_(plan, plan.share(host), false), failures_(engine.failures().size()) {}

void HostObserver::at(Tick now, proto::Observations& to) const {
  if (sampler_.any()) {
    sampler_.sample(
        now, HostMemory(engine_), [this](std::uint32_t robot) { return engine_.battery_V(robot); }, to);
  }
}

void HostObserver::stepped(Tick from, proto::Observations& to) {
  for (; failures_ < engine_.failures().size(); ++failures_) {
    const auto& failure = engine_.failures()[failures_];
    note_failure(from, failure.robot, failure.text, to);
  }
}

}  // namespace kilotwin::behaviours

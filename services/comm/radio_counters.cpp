#include "services/comm/radio_counters.hpp"

#include <algorithm>

#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin::comm {

const RadioCounter* radio_counter(std::string_view name) {
  const auto* const found = std::find_if(kRadioCounters.begin(), kRadioCounters.end(),
                                         [name](const RadioCounter& counter) { return counter.name == name; });
  return found == kRadioCounters.end() ? nullptr : found;
}

CounterSampler::CounterSampler(const RunPlan& plan) {
  const proto::Manifest& manifest = plan.manifest();
  for (int v = 0; v < manifest.variable_size(); ++v) {
    const proto::ProgramVariable& variable = manifest.variable(v);
    const RadioCounter* const counter = radio_counter(variable.name());
    // With a place in a program it is that program's variable.
    if (counter == nullptr || variable.place_size() > 0) continue;
    recorded_.push_back(
        {static_cast<std::uint32_t>(v), counter, RecordingSchedule(plan.tick_length, variable.every_s())});
  }
  for (std::uint32_t robot = 0; robot < plan.robots() && !recorded_.empty(); ++robot)
    if (plan.program_of(robot) != kNoProgram) robots_.push_back(robot);
}

void CounterSampler::sample(Tick now, std::span<const RadioCount> counts, proto::Observations& to) const {
  if (robots_.empty()) return;
  for (const Recorded& recorded : recorded_) {
    if (!recorded.schedule.due(now)) continue;
    proto::VariableRecord& record = *to.add_variable();
    record.set_tick(now.count());
    record.set_variable(recorded.variable);
    for (const std::uint32_t robot : robots_) {
      record.add_robot(robot);
      record.add_integer(counts[robot].*recorded.counter->count);
    }
  }
}

}  // namespace kilotwin::comm

/// RadioObserver: what the radio observes for the recording: messages sent and received, counters, and variables of
/// firmware robots. It changes no result.
#pragma once

#include "core/observations/events.hpp"
#include "core/observations/variable_sampler.hpp"
#include "services/comm/radio_counters.hpp"
#include "services/comm/radio_engine.hpp"

namespace kilotwin::comm {

class RadioObserver {
 public:
  /// Lets the engine log messages where the run records them.
  RadioObserver(const RunPlan& plan, RadioEngine& engine);

  /// Adds the variables that are due at `now`, the engine's tick.
  void at(Tick now, proto::Observations& to) const;
  /// Adds what happened in the last step, from tick `from`.
  void stepped(Tick from, proto::Observations& to) const;

 private:
  const RadioEngine& engine_;
  const RecordedEvents events_;
  const VariableSampler sampler_;
  const CounterSampler counters_;
  const TickLength tick_length_;
};

}  // namespace kilotwin::comm

/// HostObserver: what a behaviours host observes for the recording. It changes no result.
#pragma once

#include <cstddef>
#include <memory>

#include "core/observations/variable_sampler.hpp"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

class HostObserver {
 public:
  /// Failures that the engine knows already are not reported again.
  HostObserver(const RunPlan& plan, HostId host, const BehavioursEngine& engine);

  /// Adds the variables that are due at `now`, the engine's tick.
  void at(Tick now, proto::Observations& to) const;
  /// Adds what happened in the last step, from tick `from`.
  void stepped(Tick from, proto::Observations& to);

 private:
  const BehavioursEngine& engine_;
  const VariableSampler sampler_;
  std::size_t failures_;  ///< reported
};

}  // namespace kilotwin::behaviours

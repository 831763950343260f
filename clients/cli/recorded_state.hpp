/// The state of all robots at one tick, as recordings hold it.
#pragma once

#include <string>

#include "clients/recorder/writer.hpp"
#include "core/effects/measurement.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

class RecordedState {
 public:
  explicit RecordedState(const RunPlan& plan) : measurement_(plan) {}

  /// Of a swarm, with what the tracker measures of it. Valid until the next call, and as long as the swarm.
  [[nodiscard]] recorder::StateView of(const SwarmView&);

 private:
  Measurement measurement_;
  MeasuredPoses measured_;
};

/// The first value that differs, in words: "robot 3: x_mm is 1.5, recorded was 1.25". Empty where every bit agrees.
[[nodiscard]] std::string first_difference(const recorder::StateView& state, const proto::StateRecord& recorded);

}  // namespace kilotwin::cli

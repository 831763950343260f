/// The state of all robots at one tick, in the form that recordings hold.
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

  /// The state of a swarm with its measured poses. Valid until the next call and as long as the swarm.
  [[nodiscard]] recorder::StateView of(const SwarmView&);

 private:
  Measurement measurement_;
  MeasuredPoses measured_;
};

/// The first difference as text: "robot 3: x_mm is 1.5, recorded was 1.25". Empty if all bits agree.
[[nodiscard]] std::string first_difference(const recorder::StateView& state, const proto::StateRecord& recorded);

}  // namespace kilotwin::cli

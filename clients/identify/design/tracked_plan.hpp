/// The tracks that a model predicts for a planned recording, by the simulator's own engine.
#pragma once

#include <vector>

#include "clients/identify/design/recording_plan.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// Samples by robot and instant. All robots are sampled at the same times: 0, every_s, 2 every_s...
using PlanTracks = std::vector<std::vector<Sample>>;

/// The model without the noise of the tracker. The noise of the motion stays: two models with the same seed meet the same
/// disturbances.
[[nodiscard]] proto::Model without_tracker_noise(const proto::Model&);

/// Whether what a robot does depends on other robots: neighbours, floors that change with use.
[[nodiscard]] bool couples_robots(const proto::Model&);

/// `contacts`: whether robots collide. `seed`: of the noise, and of the biases of robots that the model does not list. Deterministic in
/// its arguments.
[[nodiscard]] PlanTracks play_plan(const RecordingPlan&, const proto::Model&, double every_s, bool contacts,
                                   std::uint64_t seed);

}  // namespace kilotwin::identify

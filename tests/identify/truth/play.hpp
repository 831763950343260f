/// Simulation of scenes: true motion and measurements.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// Deterministic in scene and seed. Runs are numbered from 0, test runs after training runs. Robots are numbered
/// from 0 and are the same in all runs. Faults affect the samples of training runs.
Play play(const Scene& scene, std::uint64_t seed);

/// The latest order at time_s.
Motion motion_at(const std::vector<Order>& orders, double time_s);

}  // namespace kilotwin::truth

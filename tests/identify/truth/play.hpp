/// Plays scenes: what robots did and what the tracker saw.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// The same bits for the same scene and seed. Runs are numbered from 0, test runs after training runs; robots from 0 and the
/// same in all runs. Faults are in the samples of training runs.
Play play(const Scene& scene, std::uint64_t seed);

/// What is ordered at time_s, by the latest order.
Motion motion_at(const std::vector<Order>& orders, double time_s);

}  // namespace kilotwin::truth

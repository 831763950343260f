/// Simulation of the grid experiment: the radio engine with robots that behave like behaviours/ir_grid.c.
#pragma once

#include "clients/identify/radio/grid_data.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::radio_fit {

/// Transmission time of a robot, in its own kilo_ticks.
inline constexpr int kDuration_kilo_ticks = 150 * 32;

/// Runs a grid like `set` with a radio model. A pure function.
[[nodiscard]] GridRun simulate(const GridSet& set, const proto::Radio& radio, std::uint64_t seed);
/// One run per seed from `first_seed` on, for a set like `set`.
[[nodiscard]] GridSet simulate(const GridSet& set, const proto::Radio& radio, int runs, std::uint64_t first_seed);

}  // namespace kilotwin::radio_fit

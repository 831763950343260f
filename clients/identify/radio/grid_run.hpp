/// The grid experiment simulated: the radio engine alone, with robots that do what behaviours/ir_grid.c does.
#pragma once

#include "clients/identify/radio/grid_data.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::radio_fit {

/// kilo_ticks, of its own, for which a robot sends.
inline constexpr int kDuration_kilo_ticks = 150 * 32;

/// Runs a grid like `set` with a radio. A pure function of the arguments.
[[nodiscard]] GridRun simulate(const GridSet& set, const proto::Radio& radio, std::uint64_t seed);
/// One run for each seed from `first_seed` on, in a set like `set`.
[[nodiscard]] GridSet simulate(const GridSet& set, const proto::Radio& radio, int runs, std::uint64_t first_seed);

}  // namespace kilotwin::radio_fit

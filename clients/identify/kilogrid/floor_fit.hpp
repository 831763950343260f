/// A model of the floor fitted by simulation: the statistics of simulated runs are brought near those of measured ones.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

using FloorProgress = std::function<void(const std::string&)>;

/// Regresses the statistics on all parameters over a design of simulated runs, and goes to where they fit best; `rounds` times
/// with ever smaller steps. Returns the misfit at the end, by new simulations.
double fit(FloorModel&, const FloorTarget&, int rounds, double width, std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

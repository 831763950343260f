/// A model of the floor fitted by simulation: the statistics of simulated runs are brought near those of measured ones.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

using FloorProgress = std::function<void(const std::string&)>;

/// Regresses the statistics on all parameters over a design of simulated runs, and goes to where they fit best, `rounds` times;
/// where that was best stays. Returns the misfit there.
double fit(FloorModel&, const FloorTarget&, int rounds, double width, std::uint64_t seed, const FloorProgress&);

/// Before that, for starts that may be far off: over wide steps first, by short quick runs.
void fit_from_afar(FloorModel&, const FloorTarget&, std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

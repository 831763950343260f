/// Numbers of effects with their 95 % intervals: centres and velocities of circles, wave numbers, decay times, instants of steps.
#pragma once

#include <vector>

#include "clients/identify/fit/step_intervals.hpp"
#include "clients/identify/fit/uncertainty.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// Of one term, in the order of its factors; then its steps in ascending order; then the amplitudes of known tables.
[[nodiscard]] std::vector<identification::Estimate> estimates_of(std::size_t term, const Uncertainty&,
                                                                 const std::vector<StepInterval>&);

}  // namespace kilotwin::identify

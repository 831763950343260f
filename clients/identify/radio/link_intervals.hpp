/// Numbers of a link model that all sets share, with 95 % intervals by a jackknife over robots: each robot's rows are left out in turn
/// (Snijders and Borgatti, Non-parametric standard errors and tests for network statistics, Connections 22, 1999). Robots are the sample:
/// more runs of the same robots tell no more of others.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/radio/link_fit.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::radio_fit {

/// Range, losses and standard deviations of `fitted`, the model of these sets. Standard deviations over robots and links are at least 0.
/// That of the placements has no interval: each set is one placement. At least 4 robots.
[[nodiscard]] std::vector<identification::Estimate> numbers_of(const LinkModel& fitted,
                                                               const std::vector<GridSet>& sets,
                                                               std::uint32_t threads);

}  // namespace kilotwin::radio_fit

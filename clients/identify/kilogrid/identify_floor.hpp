/// Identification from Kilogrid runs: the base model is fitted by simulation, then effects are selected one by
/// one. Validation on held-out runs uses statistics, cell predictions and their likelihood, and a classifier
/// two-sample test.
#pragma once

#include <vector>

#include "clients/identify/identify.hpp"
#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid {

/// `test` empty: holds out every third run of `train`.
[[nodiscard]] identify::Identified identify_floor(std::vector<FloorRun> train, std::vector<FloorRun> test,
                                                  const identify::Options&);

}  // namespace kilotwin::kilogrid

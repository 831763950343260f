/// The measured-data loop for runs of an instrumented floor: the base model fitted by simulation, effects added one after the
/// other and kept where runs that were held out agree, and judged three times: by statistics of held-out runs, by predictions and
/// likelihood of cells, and by whether a classifier can tell simulated from measured runs.
#pragma once

#include <vector>

#include "clients/identify/identify.hpp"
#include "clients/identify/kilogrid/floor_log.hpp"

namespace kilotwin::kilogrid {

/// `test` empty: every third run of `train` is held out. Writes the document of identify/identify.hpp, with these beside it:
///   contract.statistics  [{name, covariate, labels, measured, tolerance, before, after}] of the runs held out
///   contract.classifier  {measured, before, after, runs [..]}: areas under the curve, 0.5 where runs cannot be told apart
///   contract.floor       what cells hear, and robots of the rim: nuisances that were fitted as well
[[nodiscard]] identify::Identified identify_floor(std::vector<FloorRun> train, std::vector<FloorRun> test,
                                                  const identify::Options&);

}  // namespace kilotwin::kilogrid

/// Identification from bristle plate tracks: selects effects of table and tracker, and evaluates predictions on
/// held-out runs.
#pragma once

#include "clients/identify/bristle/bristle_set.hpp"
#include "clients/identify/identify.hpp"

namespace kilotwin::bristle {

/// `test` empty: holds out every fourth run of `train`.
[[nodiscard]] identify::Identified identify_bristle(std::vector<BristleRun> train, std::vector<BristleRun> test,
                                                    const identify::Options&);

}  // namespace kilotwin::bristle

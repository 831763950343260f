/// Identification from bristle plate tracks: selects effects of table and tracker, and evaluates predictions on
/// held-out runs.
#pragma once

#include <memory>
#include <vector>

#include "clients/identify/bristle/bristle_set.hpp"
#include "clients/identify/study.hpp"

namespace kilotwin::bristle {

/// The study of bristle plate tracks. `test` empty: holds out every fourth run of `train`. Throws UserError if no run is long enough.
[[nodiscard]] std::unique_ptr<identify::Study> bristle_study(std::vector<BristleRun> train,
                                                             std::vector<BristleRun> test,
                                                             const identify::Options&);

}  // namespace kilotwin::bristle

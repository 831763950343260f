/// The measured-data loop for robots that are always on: which of a few effects their tracks show, and by how much the error on
/// runs held out falls. Writes the document of identify/identify.hpp.
#pragma once

#include "clients/identify/bristle/bristle_set.hpp"
#include "clients/identify/identify.hpp"

namespace kilotwin::bristle {

/// `test` empty: every fourth run of `train` is held out.
[[nodiscard]] identify::Identified identify_ridden(std::vector<RiddenRun> train, std::vector<RiddenRun> test,
                                                   const identify::Options&);

}  // namespace kilotwin::bristle

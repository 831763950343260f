/// The recording that `kilotwin run --view` adds to that of the experiment, for the page.
#pragma once

#include <string>
#include <vector>

#include "idl/experiment.pb.h"

namespace kilotwin::cli {

/// Largest swarm for which more is recorded: messages take some 6 kB per robot and minute.
inline constexpr std::uint32_t kMostRobotsForPage = 1000;
/// Most variables of programs that are added.
inline constexpr std::size_t kMostVariablesForPage = 16;

/// Adds messages sent and received, the radio's counters and the programs' scalar variables to the recording. The caller's own
/// entries stay, and come first. `elves`: the compiled programs. Recording changes no result.
void record_for_page(const std::vector<std::string>& elves, proto::Recording& recording);

}  // namespace kilotwin::cli

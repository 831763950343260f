/// The scenes that judge the identification, by name.
#pragma once

#include <string>
#include <vector>

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// One or more per covariate, look-alikes, two at once, near the noise, faults: all in the order of the table.
std::vector<std::string> scenario_names();

/// Throws std::invalid_argument where there is none of that name.
Scene scenario(const std::string& name);

/// A small scene without any effect; everything else about it, from the tracker to the room, follows from `seed`.
Scene nothing_to_find(std::uint64_t seed);

}  // namespace kilotwin::truth

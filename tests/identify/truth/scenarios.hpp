/// The scenes of the evaluation, by name.
#pragma once

#include <string>
#include <vector>

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// At least one per covariate, look-alikes, combinations, weak effects, faults: in the order of the table.
std::vector<std::string> scenario_names();

/// "nothing:SEED" is nothing_to_find(SEED), "random:SEED" random_effects(SEED). Throws std::invalid_argument for an unknown name.
Scene scenario(const std::string& name);

/// A small scene without effect. Everything else, from tracker to arena, depends on `seed`.
Scene nothing_to_find(std::uint64_t seed);

}  // namespace kilotwin::truth

/// Effects drawn at random: nobody chose them with the identification in mind.
#pragma once

#include <cstdint>

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// A scene with one random effect, in one set of three with two, in a laboratory of a random kind. An effect acts on the speed, one wheel,
/// the turn rate, drift, slip, camera or compass, and depends on one or two covariates by random functions. All follows from `seed`.
Scene random_effects(std::uint64_t seed);

}  // namespace kilotwin::truth

/// Effects drawn at random: nobody chose them with the identification in mind.
#pragma once

#include <cstdint>

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// A scene with one random effect, in one set of three with two. What acts (speed, one wheel, turn rate, drift, slip, camera, compass), on
/// which one or two covariates it depends, and by which functions, depends on `seed`; so does the laboratory.
Scene random_effects(std::uint64_t seed);

}  // namespace kilotwin::truth

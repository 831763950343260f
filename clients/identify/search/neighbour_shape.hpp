/// The shape of an effect of neighbours on speed: how near they count, and how many of them how much.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Puts, in place of a term by which neighbours change the speed, those of many forms that make the data most probable:
/// tables of how many there are within a radius, sums over all of them that fall off with the distance, curves of the
/// distance to the nearest. False, and nothing done, where the term is of another kind.
bool shape_neighbours(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

/// The shape of an effect of what the floor remembers: how large its cells are, and what how much time on them does.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Finds the size of the cells that makes the data most probable, and the curve. False, and nothing done, where the term is of
/// another kind.
bool shape_memory(const Fitter&, MotionModel&, std::size_t term);

}  // namespace kilotwin::identify

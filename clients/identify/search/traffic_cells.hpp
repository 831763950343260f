/// Where the cells lie in which a floor remembers: their side and their corner.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// The cells in which the time that driven robots stood tells most of how fast robots of this model were, starting from some.
/// The model says nothing of what the floor remembers. Looked at are robots that do what `during` has.
[[nodiscard]] FloorCells find_cells(const Fitter&, const MotionModel&, const FloorCells& from, std::uint8_t during);

}  // namespace kilotwin::identify

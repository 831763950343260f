/// Cell size and position of a traffic grid.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// The grid whose driven time per cell explains most of the speed residuals, by a local search from `from`. The
/// model must not use traffic itself. Uses robots under the commands `during`.
[[nodiscard]] GridCells fit_grid_cells(const Fitter&, const FitState&, const GridCells& from, std::uint8_t during);

}  // namespace kilotwin::identify

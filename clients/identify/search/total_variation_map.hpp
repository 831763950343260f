/// Maps of the floor with sharp edges.
#pragma once

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// Replaces a term's smooth map of the speed or the turn rate by values on a fine grid. Their total variation prior (Rudin, Osher,
/// Fatemi 1992) preserves edges. Only if the cross-validated likelihood over robots rises. Known factors that multiply the map stay.
void fit_total_variation_map(const Fitter&, FitState&, std::size_t term);

}  // namespace kilotwin::identify

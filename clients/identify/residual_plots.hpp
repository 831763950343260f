/// The filter's corrections over covariates and over the arena, as plots of the page.
#pragma once

#include "clients/identify/fit/residuals.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// Fills covariate_plots and maps, with the base model and with the effects.
void add_residual_plots(identification::Identification&, const std::vector<Disturbance>& before,
                        const std::vector<Disturbance>& after);

}  // namespace kilotwin::identify

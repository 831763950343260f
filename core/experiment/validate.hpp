/// Validation of an experiment: its fields, the files that it names, and the placement of its robots.
#pragma once

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Throws UserError "WHERE: what is wrong; what would be right".
void validate(const LoadedExperiment& loaded);

}  // namespace kilotwin

/// Whether an experiment makes sense: its fields, the files that it names, and the places of its robots.
#pragma once

#include "core/experiment/load.hpp"

namespace kilotwin {

/// Throws UserError "WHERE: what is wrong; what would be right".
void validate(const LoadedExperiment& loaded);

}  // namespace kilotwin

/// `kilotwin run`: an experiment from its file to its summary.
#pragma once

#include "clients/cli/run_arguments.hpp"

namespace kilotwin::cli {

/// Returns the exit status. Throws UserError and RunError. `start_monotonic_s`: when the command was given, steady clock.
int run_command(const RunArguments& arguments, double start_monotonic_s);

}  // namespace kilotwin::cli

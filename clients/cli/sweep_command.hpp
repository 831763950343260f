/// `kilotwin sweep`: many local runs on all cores, a table and curves with standard errors, and plots.
#pragma once

#include "clients/cli/run_arguments.hpp"

namespace kilotwin::cli {

struct SweepArguments {
  RunArguments run;              ///< what all runs share
  std::string seeds;             ///< "A..B", or one number; empty: the experiment's own
  std::vector<std::string> set;  ///< FIELD=V1,V2,... or FIELD=A..B: one run per value, all combinations
  /// The observable that plots show: clients/recorder/observables.hpp; empty: pushed where there are movable bodies, else msd.
  std::string plot;
  std::uint32_t jobs = 0;     ///< runs at a time; 0: one per core
  std::filesystem::path out;  ///< default: runs/NAME-sweep
};

/// Returns the exit status: 1 where some run failed. Throws UserError.
int sweep_command(const SweepArguments& arguments);

}  // namespace kilotwin::cli

/// One program, run natively and as firmware in the same experiment.
#pragma once

#include <filesystem>
#include <string>

#include "tests/validation/programs/outcome.hpp"

namespace kilotwin::validation {

struct PairSettings {
  std::string kilotwin;           ///< the program
  std::filesystem::path scratch;  ///< directory for experiments and runs
  int robots = 4;
  double duration_s = 12;
  std::string light =
      "ambient: 20 source { x_mm: 400 y_mm: 300 intensity: 60 }";  ///< the experiment's field `light`
};

/// Runs `program` as `avr` says with the seeds first_seed..last_seed and adds what the robots did to `outcome`. A run that takes
/// more than ten minutes is ended and counts as refused.
void run_program(const PairSettings& settings, const std::filesystem::path& program, bool avr, int first_seed,
                 int last_seed, Outcome& outcome);

}  // namespace kilotwin::validation

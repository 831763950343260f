#include "clients/cli/run_arguments.hpp"

#include <CLI/CLI.hpp>

namespace kilotwin::cli {

void add_experiment_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("EXPERIMENT", arguments.experiment, "experiment file (*.txtpb)")->required();
  app.add_option("--duration", arguments.duration_s, "simulated time, s");
  app.add_option("--robots", arguments.robots, "replaces the first robot group's count");
  app.add_option("--behaviour", arguments.behaviour,
                 "replaces the first robot group's program (.c, .so, .elf or .hex)");
  app.add_option("--define", arguments.define, "NAME=VALUE: a macro for the programs that are compiled")
      ->allow_extra_args(false);
  app.add_option("--model", arguments.model, "model file (*.txtpb) in place of the experiment's model");
}

}  // namespace kilotwin::cli

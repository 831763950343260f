#include "clients/cli/run_arguments.hpp"

#include <CLI/CLI.hpp>

namespace kilotwin::cli {

void add_experiment_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("EXPERIMENT", arguments.experiment, "experiment file (*.txtpb)")->required()->type_name("");
  app.add_option("--duration", arguments.duration_s, "simulated time, s")->type_name("SECONDS");
  app.add_option("--robots", arguments.robots, "replaces the first robot group's count")->type_name("N");
  app.add_option("--behaviour", arguments.behaviour,
                 "replaces the first robot group's program (.c, .so, .elf or .hex)")
      ->type_name("FILE");
  app.add_option("--define", arguments.define, "a macro for the programs that are compiled")
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE");
  app.add_option("--model", arguments.model, "model file (*.txtpb) in place of the experiment's model")
      ->type_name("FILE");
}

}  // namespace kilotwin::cli

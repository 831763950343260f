#include "clients/cli/door_options.hpp"

namespace kilotwin::cli {

void add_door_options(CLI::App& app, DoorArguments& arguments, const std::string& kind) {
  app.add_option("EXPERIMENT", arguments.experiment, "experiment file with a block door { " + kind + " { ... } }")
      ->required()
      ->type_name("");
  app.add_option("--door", arguments.door, "name of the door, where the experiment has several")->type_name("NAME");
  app.add_option("--domain", arguments.run.domain, "DDS domain of the run")
      ->required()
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->type_name("N");
  app.add_option(
         "--peer", arguments.run.peers,
         "address of a machine of the run; give each of them, this machine too (default: all on this machine)")
      ->allow_extra_args(false)
      ->type_name("ADDRESS");
}

}  // namespace kilotwin::cli

// `kilotwin config`: prints the DDS configuration with which a program joins a run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "clients/cli/commands.hpp"
#include "core/dds/dds.hpp"

namespace kilotwin::cli {

Command add_config(CLI::App& program) {
  const auto transport = std::make_shared<dds::Transport>();
  CLI::App& app =
      *program.add_subcommand("config", "print the Cyclone DDS configuration with which other programs join a run");
  app.add_option(
         "--peer", transport->peers,
         "address of a machine of the run; give each of them, this machine too (default: all on this machine)")
      ->allow_extra_args(false)
      ->type_name("ADDRESS");
  app.footer(
      "Use: CYCLONEDDS_URI=\"$(kilotwin config)\" ./your_program. The configuration is the same for all domains.");
  return {&app, [transport] {
            fmt::print("{}\n", dds::cyclone_configuration(*transport));
            return kDone;
          }};
}

}  // namespace kilotwin::cli

// The program `kilotwin-identify`, which `kilotwin identify` starts. It is a program of its own so that what simulates
// builds without it.

#include <CLI/CLI.hpp>

#include "clients/cli/program.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::cli;
  return run_program(argc, argv, "Identification of Kilotwin's model. Start: kilotwin identify --train DIR",
                     [](CLI::App& program) -> std::vector<Command> { return {add_identify(program)}; });
}

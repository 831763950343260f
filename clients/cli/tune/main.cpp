// The program `kilotwin-tune`, which `kilotwin tune` starts. It is a program of its own so that what simulates builds without pagmo.

#include <CLI/CLI.hpp>

#include "clients/cli/program.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::cli;
  return run_program(argc, argv, "Optimisation by Kilotwin. Start: kilotwin tune EXPERIMENT --vary FIELD=A..B",
                     [](CLI::App& program) -> std::vector<Command> { return {add_tune(program)}; });
}

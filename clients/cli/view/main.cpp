// The program `kilotwin-view`, which `kilotwin view` starts. It is a program of its own so that services load no web server.

#include <CLI/CLI.hpp>

#include "clients/cli/program.hpp"
#include "clients/cli/view_command.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::cli;
  return run_program(argc, argv, "A web page of a run. Start: kilotwin view RUN",
                     [](CLI::App& program) -> std::vector<Command> { return {add_view(program)}; });
}

// The program `kilotwin-vision`, which `kilotwin cameras`, `kilotwin track` and `kilotwin movie` start. It is a program of its
// own so that the simulator builds and runs without OpenCV and librsvg.

#include <CLI/CLI.hpp>

#include "clients/cli/program.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::cli;
  return run_program(argc, argv, "Pictures of arenas: drawn and tracked. Start: kilotwin track SOURCE --out F.csv",
                     [](CLI::App& program) -> std::vector<Command> {
                       return {add_cameras(program), add_track(program), add_movie(program)};
                     });
}

// The program `kilotwin`. commands.hpp lists its commands.

#include <CLI/CLI.hpp>
#include <chrono>

#include "clients/cli/program.hpp"
#include "clients/cli/view_command.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::cli;
  const double started_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  return run_program(argc, argv,
                     "Kilotwin simulates swarms of Kilobots as services over DDS. Start: kilotwin run EXPERIMENT",
                     [started_s](CLI::App& program) -> std::vector<Command> {
                       return {add_run(program, started_s), add_check(program),    add_build(program),
                               add_sweep(program),          add_tune(program),     add_export(program),
                               add_replay(program),         add_identify(program), add_service(program, started_s),
                               add_ros2(program),           add_play(program),     add_listen(program),
                               add_config(program),         add_ohc(program),      add_cameras(program),
                               add_track(program),          add_movie(program),    add_view(program),
                               add_debug(program),          add_import(program),   add_doctor(program),
                               add_control(program),        add_arenas(program)};
                     });
}

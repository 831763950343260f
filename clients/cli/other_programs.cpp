// The commands that are programs of their own, because they need packages that the simulator does not. `kilotwin` starts them.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"
#include "clients/cli/view_command.hpp"

namespace kilotwin::cli {

Command add_identify(CLI::App& program) {
  return add_other_program(program, "identify", "fit the model to measured data and find effects that it lacks",
                           "kilotwin-identify");
}

Command add_tune(CLI::App& program) {
  return add_other_program(
      program, "tune", "find values of a program or an experiment that make an observable best", "kilotwin-tune");
}

Command add_view(CLI::App& program) {
  return add_other_program(program, "view", "a web page of a recorded or live run", "kilotwin-view");
}

Command add_movie(CLI::App& program) {
  return add_other_program(program, "movie", "a video file of a recorded run: .mp4, .webm or .gif",
                           "kilotwin-vision");
}

Command add_cameras(CLI::App& program) {
  return add_other_program(program, "cameras", "pictures of the simulated arena for a real station or tracker",
                           "kilotwin-vision");
}

Command add_track(CLI::App& program) {
  return add_other_program(program, "track", "poses and LEDs of real robots from a camera or from pictures",
                           "kilotwin-vision");
}

}  // namespace kilotwin::cli

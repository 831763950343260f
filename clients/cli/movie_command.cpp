// `kilotwin movie`: the program kilotwin-vision, which alone needs librsvg.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_movie(CLI::App& program) {
  return add_other_program(program, "movie", "a video file of a recorded run: .mp4, .webm or .gif",
                           "kilotwin-vision");
}

}  // namespace kilotwin::cli

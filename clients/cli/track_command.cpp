// `kilotwin track`: the program kilotwin-vision, which alone needs OpenCV.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_track(CLI::App& program) {
  return add_other_program(program, "track", "poses and LEDs of real robots from a camera or from pictures",
                           "kilotwin-vision");
}

}  // namespace kilotwin::cli

// `kilotwin cameras`: the program kilotwin-vision, which alone needs OpenCV.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_cameras(CLI::App& program) {
  return add_other_program(program, "cameras", "pictures of the simulated arena for a real station or tracker",
                           "kilotwin-vision");
}

}  // namespace kilotwin::cli

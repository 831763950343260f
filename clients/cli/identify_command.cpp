// `kilotwin identify`: the program kilotwin-identify.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_identify(CLI::App& program) {
  return add_other_program(program, "identify", "fit the model to measured data and find effects that it lacks",
                           "kilotwin-identify");
}

}  // namespace kilotwin::cli

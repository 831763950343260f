// `kilotwin tune`: the program kilotwin-tune.
#include "clients/cli/commands.hpp"
#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_tune(CLI::App& program) {
  return add_other_program(
      program, "tune", "find values of a program or an experiment that make an observable best", "kilotwin-tune");
}

}  // namespace kilotwin::cli

// `kilotwin view`: the program kilotwin-view, which alone needs libwebsockets.
#include "clients/cli/view_command.hpp"

#include "clients/cli/other_program.hpp"

namespace kilotwin::cli {

Command add_view(CLI::App& program) {
  return add_other_program(program, "view", "a web page of a recorded or live run", "kilotwin-view");
}

}  // namespace kilotwin::cli

/// The command `view`: of `kilotwin` it starts `kilotwin-view`, which does the work.
#pragma once

#include "clients/cli/commands.hpp"

namespace kilotwin::cli {

[[nodiscard]] Command add_view(CLI::App& program);

}  // namespace kilotwin::cli

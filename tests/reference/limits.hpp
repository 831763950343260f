/// Markdown tables from the constants that the code enforces.
#pragma once

#include <string>

namespace kilotwin::reference {

/// The limits of the program.
[[nodiscard]] std::string limits_table();

/// The radio's counters that a run can record.
[[nodiscard]] std::string counters_table();

}  // namespace kilotwin::reference

/// The limits of the program as a Markdown table, from the constants that the code enforces.
#pragma once

#include <string>

namespace kilotwin::reference {

[[nodiscard]] std::string limits_table();

}  // namespace kilotwin::reference

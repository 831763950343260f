/// `kilotwin doctor`: what on this machine would keep an experiment from running, and the remedy.
#pragma once

#include <cstdint>
#include <optional>

namespace kilotwin::cli {

/// Prints one line per check; returns 0 where nothing keeps an experiment from running, else 1.
int doctor_command(std::optional<std::uint32_t> domain);

}  // namespace kilotwin::cli

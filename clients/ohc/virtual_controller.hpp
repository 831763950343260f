/// `kilotwin ohc --pty`: a controller in software. Station programs open its pseudo-terminal as the serial port of a real one;
/// what they send goes to the run as external input.
#pragma once

#include <cstdint>
#include <filesystem>

namespace kilotwin::ohc {

/// Works until SIGINT or SIGTERM. Throws UserError where the link cannot be made.
void run_virtual_controller(const std::filesystem::path& link, std::uint32_t domain);

}  // namespace kilotwin::ohc

/// `kilotwin ohc --serial`: a physical controller does what the simulated station of a run tells its own.
#pragma once

#include <cstdint>
#include <filesystem>

namespace kilotwin::ohc {

/// Works until SIGINT or SIGTERM. However it ends, a guard process sends STOP. Throws UserError where the port cannot be
/// opened, RunError where the guard is lost.
void run_real_controller(const std::filesystem::path& device, std::uint32_t domain);

}  // namespace kilotwin::ohc

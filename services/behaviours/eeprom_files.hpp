/// Files with the EEPROM contents of a run's robots.
#pragma once

#include <filesystem>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// Writes eeprom/ID.eeprom, 1024 octets, into the run directory for each robot of the host whose EEPROM the experiment states or
/// its program has written to. Throws RunError.
void write_eeproms(const BehavioursEngine& engine, Share share, const std::filesystem::path& run_directory);

}  // namespace kilotwin::behaviours

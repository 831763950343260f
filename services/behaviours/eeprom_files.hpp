/// The EEPROMs of a run's robots as files.
#pragma once

#include <filesystem>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// Writes eeprom/ID.eeprom, 1024 octets, into the run directory for each robot of the host that has an EEPROM of its own:
/// brought along, or written to. Throws RunError.
void write_eeproms(const BehavioursEngine& engine, Share share, const std::filesystem::path& run_directory);

}  // namespace kilotwin::behaviours

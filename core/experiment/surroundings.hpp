/// Checks of light and batteries, and readers of the pictures and EEPROM files that an experiment names.
#pragma once

#include <vector>

#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {

/// Checks dependencies between fields of light and batteries. Throws UserError "WHERE: what is wrong; what would be right".
void check_surroundings(const LoadedExperiment& loaded);

/// The brightness of all pictures of the experiment's light, in order. Throws UserError if one is not a PNG file.
[[nodiscard]] std::vector<proto::LightRaster> read_light_rasters(const LoadedExperiment& loaded);

/// The EEPROMs that groups state, and those of cells; `counts`: robots per group. Throws UserError if a file does not have 1024
/// octets.
[[nodiscard]] std::vector<proto::RobotEeprom> read_eeproms(const LoadedExperiment& loaded,
                                                           const std::vector<std::uint32_t>& counts);

}  // namespace kilotwin

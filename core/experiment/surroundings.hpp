/// What an experiment names of robots' surroundings: pictures of light, and EEPROMs.
#pragma once

#include <vector>

#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {

/// Checks what fields of light and batteries demand of each other. Throws UserError "WHERE: what is wrong; what would be right".
void check_surroundings(const LoadedExperiment& loaded);

/// The brightness of all pictures of the experiment's light, in order. Throws UserError where one is no PNG file.
[[nodiscard]] std::vector<proto::LightRaster> read_light_rasters(const LoadedExperiment& loaded);

/// The EEPROMs that groups bring along; `counts`: robots per group. Throws UserError where a file has not 1024 octets.
[[nodiscard]] std::vector<proto::RobotEeprom> read_eeproms(const LoadedExperiment& loaded,
                                                           const std::vector<std::uint32_t>& counts);

}  // namespace kilotwin

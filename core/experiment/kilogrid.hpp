/// Cells of a Kilogrid: checks of their groups, and the configuration that each cell gets.
#pragma once

#include <cstdint>
#include <vector>

#include "core/experiment/load.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {

/// Checks what groups of cells may be combined with. Throws UserError "WHERE: what is wrong; what would be right".
void check_cells(const LoadedExperiment& loaded);

/// The EEPROMs of group `g` of cells, whose first robot is `first`: core/base/kilogrid_cell.h. Throws UserError "FILE:LINE:1: ..."
/// for a wrong .kconf file.
[[nodiscard]] std::vector<proto::RobotEeprom> cell_eeproms(const LoadedExperiment& loaded, int g,
                                                           std::uint32_t first, std::uint32_t count);

}  // namespace kilotwin

#include "core/experiment/validate.hpp"

#include "core/experiment/layout.hpp"
#include "core/experiment/surroundings.hpp"

namespace kilotwin {

void validate(const LoadedExperiment& loaded) {
  const PlacedRobots placed = place_robots(loaded);  // this also checks the fields
  static_cast<void>(read_eeproms(loaded, placed.group_count));
  static_cast<void>(read_light_rasters(loaded));
}

}  // namespace kilotwin

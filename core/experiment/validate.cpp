#include "core/experiment/validate.hpp"

#include "core/experiment/layout.hpp"
#include "core/experiment/surroundings.hpp"

namespace kilotwin {

void validate(const LoadedExperiment& loaded) {
  static_cast<void>(place_robots(loaded));  // this also checks the fields
  static_cast<void>(read_light_rasters(loaded));
}

}  // namespace kilotwin

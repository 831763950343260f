/// Fast simulation of a swarm on the floor with steps of half a second, six times as fast as the engine, for fits
/// that need hundreds of runs. Overlapping discs are separated without tangential slip. Crowds move about 6 %
/// faster than in the engine, so the fit takes differences between models from it, and absolute values from the
/// engine.
#pragma once

#include <cstdint>

#include "clients/identify/kilogrid/floor_model.hpp"

namespace kilotwin::kilogrid {

/// One run of the model. Deterministic in its arguments.
[[nodiscard]] FloorRun simulate_fast(const FloorScene&, const Floor&, const FloorSettings&, std::uint64_t seed);

}  // namespace kilotwin::kilogrid

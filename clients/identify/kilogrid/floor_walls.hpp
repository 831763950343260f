/// The effect of walls per boundary section: slower where measured robots stay longer than simulated ones.
#pragma once

#include "clients/identify/kilogrid/floor_fit.hpp"

namespace kilotwin::kilogrid {

/// Misfit reduction by the walls, and its significance bound.
struct WallGain {
  double gain = 0, needed = 0;
  [[nodiscard]] bool found() const { return gain > needed; }
};

/// Fits the walls. They stay in the model if the reduction exceeds its 0.99 quantile in sets without walls.
WallGain fit_walls(FloorModel&, const FloorTarget&, int rounds, std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

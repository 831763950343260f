/// The effect of walls, part by part of the rim: slower where robots were measured to stay longer than they do in the model.
#pragma once

#include "clients/identify/kilogrid/floor_fit.hpp"

namespace kilotwin::kilogrid {

/// What the walls remove of the misfit, and how much of that is beyond chance.
struct WallGain {
  double gain = 0, needed = 0;
  [[nodiscard]] bool found() const { return gain > needed; }
};

/// Fits the walls; they stay in the model where they remove more than of all but 1 % of sets without them.
WallGain fit_walls(FloorModel&, const FloorTarget&, int rounds, std::uint64_t seed, const FloorProgress&);

}  // namespace kilotwin::kilogrid

/// Where robots were, and by how much their speed deviated there from the model.
#pragma once

#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// A robot at an instant: position and speed residual.
struct Visit {
  float x_mm, y_mm;
  float score, information;
  bool driven;
};
using Instant = std::vector<Visit>;

/// By run, then by instant of the raster of RunNeighbours, from its start on. Long sets: the beginning of every run. `during`:
/// commands whose residuals count, as in Block.
[[nodiscard]] std::vector<std::vector<Instant>> visits_of(const Fitter&, const FitState&, std::uint8_t during);

}  // namespace kilotwin::identify

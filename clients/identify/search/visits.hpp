/// Where robots were, and by how much their speed deviated there from the model.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// A robot at an instant: position and speed residual.
struct Visit {
  std::uint32_t robot;  ///< place of its track in the run
  float x_mm, y_mm;
  float score, information;
  bool driven;
};
using Instant = std::vector<Visit>;

struct Visits {
  std::vector<std::vector<Instant>>
      runs;        ///< by run, then by instant, from the start of the raster of RunNeighbours on
  double every_s;  ///< between instants: that raster, or a multiple of it in long sets
};

/// `during`: commands whose residuals count, as in Block.
[[nodiscard]] Visits visits_of(const Fitter&, const FitState&, std::uint8_t during);

}  // namespace kilotwin::identify

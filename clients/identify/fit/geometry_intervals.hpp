/// 95 % intervals of walls and of the disc centre by profile likelihood.
#pragma once

#include <optional>

#include "clients/identify/fit/uncertainty.hpp"

namespace kilotwin::identify {

struct GeometryIntervals {
  /// Ends of the walls' intervals, mm. Infinite: no wall, or the data do not bound it on that side.
  Walls low, high;
  /// Ends of BaseParameters::centre_mm; nothing: the data do not bound it. Without walls the likelihood says nothing about it.
  std::optional<double> centre_low_mm, centre_high_mm;
};

[[nodiscard]] GeometryIntervals geometry_intervals_of(const Fitter&, const FitState&, const Uncertainty&);

}  // namespace kilotwin::identify

/// Effect records of the model file for effects on the floor.
#pragma once

#include <array>

#include "clients/identify/kilogrid/floor_model.hpp"

namespace kilotwin::kilogrid {

proto::Effect& add_effect(FloorSettings&, const char* name, proto::Effect::Target);
proto::Function& add_function(proto::Effect&, proto::Function::Covariate of);

/// The region beside one wall: `across` is the axis normal to it, `at_mm` its inner edge.
struct Side {
  const char* name;
  proto::Function::Covariate across;
  bool above;
  double at_mm, half_along_mm;
};

[[nodiscard]] std::array<Side, 4> sides_of(const Floor&);

/// A factor that is `value` in the region and 0 elsewhere.
void add_beside(proto::Effect&, const Side&, double value);
/// Gains beside all walls per boundary section, anticlockwise from the origin: 4 along x, 8 along y.
void add_walls(FloorSettings&, const Floor&, const std::array<double, kBoundarySections>& wall);

}  // namespace kilotwin::kilogrid

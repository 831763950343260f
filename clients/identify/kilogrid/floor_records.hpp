/// Records of the model file, as the floor's effects write them.
#pragma once

#include <array>

#include "clients/identify/kilogrid/floor_model.hpp"

namespace kilotwin::kilogrid {

proto::Effect& add_effect(FloorSettings&, const char* name, proto::Effect::Target);
proto::Function& add_function(proto::Effect&, proto::Function::Covariate of);

/// Beside one wall: `across` is the axis that leads to it, `at_mm` where it begins.
struct Side {
  const char* name;
  proto::Function::Covariate across;
  bool above;
  double at_mm, half_along_mm;
};

[[nodiscard]] std::array<Side, 4> sides_of(const Floor&);

/// A factor of `value` there, of 0 elsewhere.
void add_beside(proto::Effect&, const Side&, double value);
/// Gains beside all walls: by part of the rim, anticlockwise from the corner at the origin: 4 along x, 8 along y.
void add_walls(FloorSettings&, const Floor&, const std::array<double, kRimParts>& wall);

}  // namespace kilotwin::kilogrid

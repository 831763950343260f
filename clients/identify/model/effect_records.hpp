/// Terms as records of effects, which the simulator runs.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "idl/effects.pb.h"

namespace kilotwin::identify {

/// One record where the term is a function of one covariate or two; several, of which the effects add up, where it is more.
[[nodiscard]] std::vector<proto::Effect> effects_of_term(const Term&);

/// "constant", "steps", "curve", "map", "table"... of its first block.
[[nodiscard]] const char* form_of(const Term&);

/// Of the arena field that holds what the floor remembers in cells of MotionModel::cells[cells].
[[nodiscard]] std::string field_name(std::uint8_t cells);

/// A number with seven digits.
[[nodiscard]] double rounded(double value);

}  // namespace kilotwin::identify

/// Terms of the fitted model as effect records (idl/effects.proto), which the simulator executes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "idl/effects.pb.h"

namespace kilotwin::identify {

/// One record per function of one or two covariates. Further structure becomes several records, whose effects add
/// up.
[[nodiscard]] std::vector<proto::Effect> effects_of_term(const Term&);

/// Form of the first block: "constant", "linear", "curve", "map", "harmonic", "table", "steps", "exponential" or
/// "product".
[[nodiscard]] const char* form_of(const Term&);

/// A function of a covariate, without a shape.
[[nodiscard]] proto::Function function_of(const Axis&);

/// Name of the arena field of MotionModel::cells[cells]. Those of trails start with kTrailField.
inline constexpr const char* kTrailField = "trail-";
[[nodiscard]] std::string field_name(std::uint8_t cells);

/// A number rounded to seven significant digits. 0 if not finite.
[[nodiscard]] double rounded(double value);

}  // namespace kilotwin::identify

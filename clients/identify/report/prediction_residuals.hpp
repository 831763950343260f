/// Residuals of predictions, measured minus predicted: by robot, over the arena, and over what they may depend on.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/prediction.hpp"

namespace kilotwin::identify {

/// The parts `robots`, `maps` and `covariate_plots` of the document (identify.hpp), of predictions `horizon_s` ahead:
///   robots           rms residual before and after, by robot
///   maps             mean residual along x and y, by where the robot was halfway
///   covariate_plots  for each covariate the residual that depends on it most: ahead and to the left, seen along the way
///                    that the base model predicts, or along x and y of the room
/// Measured positions are interpolated between samples at most 2.5 s apart; predictions without any are left out. Standard
/// errors allow for windows that overlap.
[[nodiscard]] nlohmann::json residual_parts(const MeasuredSet&, const std::vector<Prediction>&, double horizon_s);

}  // namespace kilotwin::identify
